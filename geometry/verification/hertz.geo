// hertz.geo - two elastic blocks of the same size, one on the other, that touch on a small patch
//
// A quarter (half = 0: x, y >= 0) or a half (half = 1: y >= 0) of the problem; planes of symmetry x = 0, y = 0.
// The blocks share nothing: the patches lie on each other node for node, every node exists twice. Lengths in mm.
//
// Run: gmsh -3 hertz.geo -nt 1 -setnumber n 8 -format msh41 -bin -o hertz.msh      Needs Gmsh 4.8 or later.
SetFactory("Built-in");
DefineConstant[
  n     = 8,     // elements along an edge of the patch (of its half along x where half = 1)
  s     = 1.5,   // the patch is x, y <= s
  size  = 60,    // height, and half width, of each block
  grow  = 0.6,   // growth of the element size with the distance from the patch
  half  = 0,
  order = 2
];
If(n < 2 || s <= 0 || size <= 2*s || grow <= 0)
  Error("hertz.geo: n = %g, s = %g, size = %g, grow = %g: n at least 2, 0 < 2 s < size, 0 < grow", n, s, size, grow); Exit;
EndIf
h  = s/n;
xi = -s*half;  xo = -size*half;

Macro OneBlock
  // From z = 0 to z = zt; out: patch, rest (z = 0), far (z = zt), planeX, planeY, vol; far corners p_grip
  pa = newp; Point(pa) = {xi, 0, 0};  pb = newp; Point(pb) = {s, 0, 0};
  pc = newp; Point(pc) = {s, s, 0};   pd = newp; Point(pd) = {xi, s, 0};
  pe = newp; Point(pe) = {size, 0, 0};   pf = newp; Point(pf) = {size, size, 0};  pg = newp; Point(pg) = {xo, size, 0};
  qe = newp; Point(qe) = {size, 0, zt};  qf = newp; Point(qf) = {size, size, zt}; qg = newp; Point(qg) = {xo, size, zt};
  qa = newp; Point(qa) = {xo, 0, zt};
  lab = newc; Line(lab) = {pa, pb};  lbc = newc; Line(lbc) = {pb, pc};
  ldc = newc; Line(ldc) = {pd, pc};  lad = newc; Line(lad) = {pa, pd};
  lbe = newc; Line(lbe) = {pb, pe};  lef = newc; Line(lef) = {pe, pf};  lfg = newc; Line(lfg) = {pf, pg};
  leq = newc; Line(leq) = {pe, qe};  lfq = newc; Line(lfq) = {pf, qf};  lgq = newc; Line(lgq) = {pg, qg};
  kae = newc; Line(kae) = {qa, qe};  kef = newc; Line(kef) = {qe, qf};  kfg = newc; Line(kfg) = {qf, qg};
  kga = newc; Line(kga) = {qg, qa};
  l = newll; Curve Loop(l) = {lab, lbc, -ldc, -lad};  patch = news; Plane Surface(patch) = {l};
  l = newll; Curve Loop(l) = {kae, kef, kfg, kga};    far   = news; Plane Surface(far) = {l};
  l = newll; Curve Loop(l) = {lef, lfq, -kef, -leq};  side  = news; Plane Surface(side) = {l};
  l = newll; Curve Loop(l) = {lfg, lgq, -kfg, -lfq};  back  = news; Plane Surface(back) = {l};
  If(half)
    po = newp; Point(po) = {xo, 0, 0};
    loa = newc; Line(loa) = {po, pa};  lgo = newc; Line(lgo) = {pg, po};  loq = newc; Line(loq) = {po, qa};
    l = newll; Curve Loop(l) = {loa, lad, ldc, -lbc, lbe, lef, lfg, lgo};  rest   = news; Plane Surface(rest) = {l};
    l = newll; Curve Loop(l) = {loa, lab, lbe, leq, -kae, -loq};           planeY = news; Plane Surface(planeY) = {l};
    l = newll; Curve Loop(l) = {lgo, loq, -kga, -lgq};                     planeX = news; Plane Surface(planeX) = {l};
  Else
    ldg = newc; Line(ldg) = {pd, pg};  laq = newc; Line(laq) = {pa, qa};
    l = newll; Curve Loop(l) = {ldc, -lbc, lbe, lef, lfg, -ldg};   rest   = news; Plane Surface(rest) = {l};
    l = newll; Curve Loop(l) = {lab, lbe, leq, -kae, -laq};        planeY = news; Plane Surface(planeY) = {l};
    l = newll; Curve Loop(l) = {lad, ldg, lgq, kga, -laq};         planeX = news; Plane Surface(planeX) = {l};
  EndIf
  Transfinite Curve {lab, ldc} = (1 + half)*n + 1;
  Transfinite Curve {lbc, lad} = n + 1;
  Transfinite Surface {patch} = {pa, pb, pc, pd};
  l = newsl; Surface Loop(l) = {patch, rest, far, side, back, planeX, planeY};
  vol = newv; Volume(vol) = {l};
Return

zt = size;  Call OneBlock;
Physical Volume("upper") = {vol};
Physical Surface("upper_patch") = {patch};
Physical Surface("upper_top") = {far};
Physical Surface("upper_y") = {planeY};
Physical Point("upper_middle") = {qa};
If(half)
  Physical Point("upper_grips") = {pe, po};
Else
  Physical Surface("upper_x") = {planeX};
EndIf
zt = -size; Call OneBlock;
Physical Volume("lower") = {vol};
Physical Surface("lower_patch") = {patch};
Physical Surface("lower_base") = {far};
Physical Surface("lower_y") = {planeY};
If(!half)
  Physical Surface("lower_x") = {planeX};
EndIf

// Size: h on the patch, growing with the distance from it.
dx = Sprintf("(Fabs(x)-%g+Fabs(Fabs(x)-%g))/2", s, s);
dy = Sprintf("(Fabs(y)-%g+Fabs(Fabs(y)-%g))/2", s, s);
Field[1] = MathEval;
Field[1].F = StrCat(Sprintf("%g+%g*Sqrt(z*z+((", h, grow), dx, ")^2)+((", dy, ")^2))");
Background Field = 1;
Mesh.CharacteristicLengthFromPoints = 0;
Mesh.CharacteristicLengthExtendFromBoundary = 0;
Mesh.Algorithm = 6; Mesh.Algorithm3D = 1; Mesh.Optimize = 1;
Mesh.MaxNumThreads1D = 1; Mesh.MaxNumThreads2D = 1; Mesh.MaxNumThreads3D = 1;
Mesh.ElementOrder = order;
Mesh.SecondOrderLinear = 1;
Mesh.SaveAll = 0;
