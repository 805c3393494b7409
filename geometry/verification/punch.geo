// punch.geo - a round punch of radius 1 with a flat end on a block, a quarter of both
//
// Planes of symmetry x = 0, y = 0. Punch and block share nothing: the discs in which they touch lie on each other node
// for node, every node exists twice. Lengths in mm.
//
// Run: gmsh -3 punch.geo -nt 1 -setnumber n 8 -format msh41 -bin -o punch.msh      Needs Gmsh 4.8 or later.
SetFactory("Built-in");
DefineConstant[
  n      = 8,    // elements along a radius, half of them in a core that is nearly a square
  size   = 60,   // height, and half width, of the block
  height = 1,    // of the punch
  grow   = 0.6,  // growth of the element size with the distance from the disc
  order  = 2
];
If(n < 2 || n != 2*Floor(n/2) || size <= 2 || height <= 0 || grow <= 0)
  Error("punch.geo: n = %g, size = %g, height = %g, grow = %g: n even, 2 < size, 0 < height, grow", n, size, height, grow); Exit;
EndIf
h = 1/n;
c = 0.5;  d = 0.4;  r = Sqrt(0.5);  // core (0, 0), (c, 0), (d, d), (0, c); r, r on the rim

Macro Disc
  // At height z, out: core, east, north, curves along x, y and the rim
  po = newp; Point(po) = {0, 0, z};
  pa = newp; Point(pa) = {c, 0, z};  pb = newp; Point(pb) = {0, c, z};  pd = newp; Point(pd) = {d, d, z};
  pe = newp; Point(pe) = {1, 0, z};  pf = newp; Point(pf) = {r, r, z};  pg = newp; Point(pg) = {0, 1, z};
  loa = newc; Line(loa) = {po, pa};  lad = newc; Line(lad) = {pa, pd};
  lob = newc; Line(lob) = {po, pb};  lbd = newc; Line(lbd) = {pb, pd};
  lae = newc; Line(lae) = {pa, pe};  ldf = newc; Line(ldf) = {pd, pf};  lbg = newc; Line(lbg) = {pb, pg};
  lef = newc; Circle(lef) = {pe, po, pf};  lfg = newc; Circle(lfg) = {pf, po, pg};
  l = newll; Curve Loop(l) = {loa, lad, -lbd, -lob};  core  = news; Plane Surface(core) = {l};
  l = newll; Curve Loop(l) = {lae, lef, -ldf, -lad};  east  = news; Plane Surface(east) = {l};
  l = newll; Curve Loop(l) = {lbd, ldf, lfg, -lbg};   north = news; Plane Surface(north) = {l};
  Transfinite Curve {loa, lad, lob, lbd, lae, ldf, lbg, lef, lfg} = n/2 + 1;
  Transfinite Surface {core} = {po, pa, pd, pb};
  Transfinite Surface {east} = {pa, pe, pf, pd};
  Transfinite Surface {north} = {pb, pd, pf, pg};
Return

// The punch: two discs and what joins them.
z = 0; Call Disc;
dO = po; dE = pe; dF = pf; dG = pg; dl() = {loa, lae, lob, lbg, lef, lfg}; discUp() = {core, east, north};
z = height;
to = newp; Point(to) = {0, 0, z};  te = newp; Point(te) = {1, 0, z};
tf = newp; Point(tf) = {r, r, z};  tg = newp; Point(tg) = {0, 1, z};
kx = newc; Line(kx) = {to, te};  ky = newc; Line(ky) = {to, tg};
k1 = newc; Circle(k1) = {te, to, tf};  k2 = newc; Circle(k2) = {tf, to, tg};
vo = newc; Line(vo) = {dO, to};  ve = newc; Line(ve) = {dE, te};  vf = newc; Line(vf) = {dF, tf};  vg = newc; Line(vg) = {dG, tg};
l = newll; Curve Loop(l) = {kx, k1, k2, -ky};                top = news; Plane Surface(top) = {l};
l = newll; Curve Loop(l) = {dl(0), dl(1), ve, -kx, -vo};     py = news; Plane Surface(py) = {l};
l = newll; Curve Loop(l) = {dl(2), dl(3), vg, -ky, -vo};     px = news; Plane Surface(px) = {l};
l = newll; Curve Loop(l) = {dl(4), vf, -k1, -ve};            s1 = news; Surface(s1) = {l};
l = newll; Curve Loop(l) = {dl(5), vg, -k2, -vf};            s2 = news; Surface(s2) = {l};
l = newsl; Surface Loop(l) = {discUp(), top, py, px, s1, s2}; vol = newv; Volume(vol) = {l};
Physical Volume("punch") = {vol};
Physical Surface("punch_end") = {discUp()};
Physical Surface("punch_top") = {top};
Physical Surface("punch_x") = {px};
Physical Surface("punch_y") = {py};
Physical Point("punch_middle") = {to};

// The block.
z = 0; Call Disc;
be = newp; Point(be) = {size, 0, 0};      bf = newp; Point(bf) = {size, size, 0};      bg = newp; Point(bg) = {0, size, 0};
qo = newp; Point(qo) = {0, 0, -size};     qe = newp; Point(qe) = {size, 0, -size};
qf = newp; Point(qf) = {size, size, -size};  qg = newp; Point(qg) = {0, size, -size};
le = newc; Line(le) = {pe, be};  lg = newc; Line(lg) = {pg, bg};
b1 = newc; Line(b1) = {be, bf};  b2 = newc; Line(b2) = {bf, bg};
wo = newc; Line(wo) = {po, qo};  we = newc; Line(we) = {be, qe};  wf = newc; Line(wf) = {bf, qf};  wg = newc; Line(wg) = {bg, qg};
k1 = newc; Line(k1) = {qo, qe};  k2 = newc; Line(k2) = {qe, qf};  k3 = newc; Line(k3) = {qf, qg};  k4 = newc; Line(k4) = {qg, qo};
l = newll; Curve Loop(l) = {le, b1, b2, -lg, -lfg, -lef};    rest = news; Plane Surface(rest) = {l};
l = newll; Curve Loop(l) = {loa, lae, le, we, -k1, -wo};     py = news; Plane Surface(py) = {l};
l = newll; Curve Loop(l) = {lob, lbg, lg, wg, k4, -wo};      px = news; Plane Surface(px) = {l};
l = newll; Curve Loop(l) = {b1, wf, -k2, -we};               s1 = news; Plane Surface(s1) = {l};
l = newll; Curve Loop(l) = {b2, wg, -k3, -wf};               s2 = news; Plane Surface(s2) = {l};
l = newll; Curve Loop(l) = {k1, k2, k3, k4};                 base = news; Plane Surface(base) = {l};
l = newsl; Surface Loop(l) = {core, east, north, rest, py, px, s1, s2, base}; vol = newv; Volume(vol) = {l};
Physical Volume("block") = {vol};
Physical Surface("block_disc") = {core, east, north};
Physical Surface("block_base") = {base};
Physical Surface("block_x") = {px};
Physical Surface("block_y") = {py};

// Size: h on the disc, growing with the distance from it.
Field[1] = MathEval;
Field[1].F = Sprintf("%g+%g*Sqrt(z*z+((Sqrt(x*x+y*y)-1+Fabs(Sqrt(x*x+y*y)-1))/2)^2)", h, grow);
Background Field = 1;
Mesh.CharacteristicLengthFromPoints = 0;
Mesh.CharacteristicLengthExtendFromBoundary = 0;
Mesh.Algorithm = 6; Mesh.Algorithm3D = 1; Mesh.Optimize = 1;
Mesh.MaxNumThreads1D = 1; Mesh.MaxNumThreads2D = 1; Mesh.MaxNumThreads3D = 1;
Mesh.ElementOrder = order;
Mesh.SecondOrderLinear = 1;
Mesh.SaveAll = 0;
