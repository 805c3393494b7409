// dovetail.geo - a compressor blade on a skewed dovetail root, and the jaw (disc sector) holding it
//
// Two bodies that touch on two flanks and share nothing: the flank meshes are structured and lie on
// each other node for node, but every node exists twice.
//
// Units: mm. Axes: x rotation axis, z radial (through the middle of the slot), y tangential.
// Slot frame: s along the slot, t across it,
//     x = s cos(skew) - t sin(skew),   y = s sin(skew) + t cos(skew).
// "left" is +t, "right" is -t.
//
// Run:  gmsh -3 dovetail.geo -nt 1 -setnumber nu 8 -setnumber nv 18 -format msh41 -bin -o dovetail.msh
// Needs Gmsh 4.8 or later (built-in kernel only).
//
// How the flanks come to match, to the last bit: every point, curve and surface is written out (no
// Extrude, no Duplicata, no Coherence, which would weld the bodies); the flank points of both bodies
// come from the same expressions; their curves run in the same direction; their surfaces are
// transfinite with the same corners in the same order. Periodic surfaces are not needed.
SetFactory("Built-in");

DefineConstant[
  // --- mesh -----------------------------------------------------------------------------------
  nu      = 4,      // corner nodes across a flank, from its lower to its upper edge
  nv      = 9,      // corner nodes along a flank
  bump    = 1,      // edge grading of the flanks: 1 uniform, < 1 refines towards all four edges
  bump_u  = bump,   //   the same, across only
  bump_v  = bump,   //   the same, along only
  diag    = 1,      // diagonals of the flanks' cells: 1 all one way, 0 alternating
  order   = 2,      // element order: 1 or 2 (linear tetrahedra are far too stiff for the airfoil)
  lc      = 6,      // far-field size (jaw)
  lc_root = 3,      // largest size in root, neck and platform
  lc_air  = 3,      // largest size in the airfoil
  lc_edge = 1.2,    // size at the leading and trailing edges
  lc_flank= 0,      // size next to the flanks; 0: from nu and nv
  grow    = 0.35,   // growth of the size per mm away from the flanks
  nfil    = 2,      // at least this many elements per 45 degrees of a fillet
  alg3d   = 0,      // 1 Delaunay, 10 HXT; 0: the one that suits (at the end of this file)
  optthr  = 0.3,    // elements worse than this are optimised
  // --- attachment -----------------------------------------------------------------------------
  skew    = 25,     // angle between slot and rotation axis, degrees
  flankdeg= 45,     // angle between flank and radial direction, degrees
  Lx      = 32,     // axial length of root and jaw; their ends are planes x = const
  wf      = 4.5,    // width of a flank
  ta      = 8,      // half width of the root at the lower edge of the flanks
  za      = 2,      // height of that edge above the bottom of the root
  cb      = 0.8,    // chamfer at the bottom of the root
  rf      = 2,      // fillet from the flank to the neck (blade)
  rj      = 2,      // fillet from the flank to the wall of the slot (jaw)
  rs      = 1.2,    // fillet at the floor of the slot (jaw)
  gap     = 1.2,    // from the bottom of the root to the floor of the slot
  lip     = 4,      // height of the jaw above the upper edge of the flanks
  zneck   = 14.5,   // height of the underside of the platform above the bottom of the root
  chn     = 1.2,    // chamfer from the neck to the platform
  hp      = 3,      // thickness of the platform
  tp      = 11,     // half width of the platform
  wj      = 22,     // half width of the jaw
  hb      = 12,     // thickness of the jaw under the slot
  Rplat   = 450,    // radius of the top of the platform
  // --- airfoil; _h at the hub, _t at the tip, linear in between ----------------------------------
  height  = 90,
  chord_h = 34,   chord_t = 36,
  stag_h  = 30,   stag_t  = 52,    // stagger from the axial direction, degrees (the twist)
  camb_h  = 0.07, camb_t  = 0.03,  // largest camber / chord
  thk_h   = 3.6,  thk_t   = 1.6,   // largest thickness (the taper)
  edge_h  = 0.7,  edge_t  = 0.5,   // thickness of the leading and trailing edges
  npts    = 9,    // spline points per side of a section
  nsec    = 7     // sections that define the radial edges
];

deg = Pi/180; sk = skew*deg; fl = flankdeg*deg;
Ls  = Lx/Cos(sk);                     // length of the slot
z0  = Rplat - (zneck + hp);           // radius of the bottom of the root
// Profile of a flank: from its lower edge A = (ta, za) to its upper edge B = (tu, zu).
tu  = ta - wf*Sin(fl);
zu  = za + wf*Cos(fl);
zT  = zu + lip;                       // top of the jaw

If(nu < 2 || nv < 2 || nu != Floor(nu) || nv != Floor(nv))
  Error("dovetail.geo: nu = %.10g, nv = %.10g: whole numbers of corner nodes, at least 2 x 2 a flank", nu, nv); Exit;
EndIf
If(npts < 2 || nsec < 2 || npts != Floor(npts) || nsec != Floor(nsec))
  Error("dovetail.geo: npts = %.10g, nsec = %.10g: whole numbers of points and sections, at least 2", npts, nsec); Exit;
EndIf
If(order != 1 && order != 2)
  Error("dovetail.geo: order = %g: 1 or 2", order); Exit;
EndIf
If(bump_u <= 0 || bump_v <= 0)
  Error("dovetail.geo: bump_u = %g, bump_v = %g: must be positive", bump_u, bump_v); Exit;
EndIf
If(skew == 0)
  Error("dovetail.geo: skew = 0: the fillets are arcs of ellipses and need a slot that is not axial"); Exit;
EndIf
If(za - rj*Sin(fl) <= -gap + rs || tu - rf*(1 - Cos(fl)) <= 0 || zT >= zneck || zu + rf*Sin(fl) >= zneck - chn || cb >= za || wj <= ta + rj*(1 - Cos(fl)) + rs)
  Error("dovetail.geo: the dimensions of the attachment do not fit together"); Exit;
EndIf

// ---------------------------------------------------------------------------------------------
Macro Prism
  // A closed profile in (t, z), carried along the slot between the two end planes.
  // in : pt(), pz() vertices; sg(i) = 1 where segment i is an arc about (ct(i), cz(i)), else 0
  // out: PF(), PR() points of the front and rear ends; LS() lines along the slot;
  //      CF(), CR() end curves, SG() their sign against the profile; FL() curve loops of the sides
  n = #pt();
  PF() = {}; PR() = {}; LS() = {}; CF() = {}; CR() = {}; SG() = {}; FL() = {};
  For i In {0:n-1}
    For e In {0:1}
      s = (e - 0.5)*Ls + pt(i)*Tan(sk);
      p = newp;
      Point(p) = {s*Cos(sk) - pt(i)*Sin(sk), s*Sin(sk) + pt(i)*Cos(sk), z0 + pz(i), lc};
      If(e == 0)
        PF() += p;
      Else
        PR() += p;
      EndIf
    EndFor
    c = newc; Line(c) = {PF(i), PR(i)}; LS() += c;
  EndFor
  For i In {0:n-1}
    j = (i + 1) % n;
    // One direction for both bodies: upwards, then towards +t.
    a = i; b = j; sgn = 1;
    If(pz(i) > pz(j) + 1e-9 || (Fabs(pz(i) - pz(j)) <= 1e-9 && pt(i) > pt(j)))
      a = j; b = i; sgn = -1;
    EndIf
    SG() += sgn;
    For e In {0:1}
      If(e == 0)
        pa = PF(a); pb = PF(b);
      Else
        pa = PR(a); pb = PR(b);
      EndIf
      If(sg(i) == 0)
        c = newc; Line(c) = {pa, pb};
      Else
        // A circle about the slot direction, cut by a plane x = const: an ellipse, longer in y.
        s = (e - 0.5)*Ls + ct(i)*Tan(sk);
        p = newp;
        Point(p) = {s*Cos(sk) - ct(i)*Sin(sk), s*Sin(sk) + ct(i)*Cos(sk), z0 + cz(i), lc};
        rr = Sqrt((pt(i)-ct(i))^2 + (pz(i)-cz(i))^2);
        s = (e - 0.5)*Ls + (ct(i)+rr)*Tan(sk); q = newp;
        Point(q) = {s*Cos(sk) - (ct(i)+rr)*Sin(sk), s*Sin(sk) + (ct(i)+rr)*Cos(sk), z0 + cz(i), lc};
        c = newc; Ellipse(c) = {pa, p, q, pb};
      EndIf
      If(e == 0)
        CF() += c;
      Else
        CR() += c;
      EndIf
    EndFor
    l = newll; Curve Loop(l) = {CF(i), LS(b), -CR(i), -LS(a)}; FL() += l;
  EndFor
Return

Macro Flank
  // Structured face fi between profile vertices ia (lower edge) and ib (upper edge).
  Transfinite Curve {LS(ia), LS(ib)} = nv Using Bump bump_v;
  Transfinite Curve {CF(fi), CR(fi)} = nu Using Bump bump_u;
  // Diagonals all one way give the pairs along an edge equal shares; the two flanks are mirrored.
  If(diag == 0)
    Transfinite Surface {FS(fi)} = {PF(ia), PR(ia), PR(ib), PF(ib)} Alternate;
  ElseIf(pt(ia) > 0)
    Transfinite Surface {FS(fi)} = {PF(ia), PR(ia), PR(ib), PF(ib)} Right;
  Else
    Transfinite Surface {FS(fi)} = {PF(ia), PR(ia), PR(ib), PF(ib)} Left;
  EndIf
Return

Macro FilletFace
  // Structured fillet fi, from profile vertex ia to ib. One curved quadratic element over a whole
  // fillet can be invalid, hence nfil.
  rr = Sqrt((pt(fi)-ct(fi))^2 + (pz(fi)-cz(fi))^2);
  al = 2*Asin(Sqrt((pt(ib)-pt(ia))^2 + (pz(ib)-pz(ia))^2)/(2*rr));
  na = 1 + Max(Ceil(nfil*al/(Pi/4) - 1e-6), Ceil(rr*al/(Sqrt((wf/(nu-1))*(Ls/(nv-1))))));
  Transfinite Curve {LS(ia), LS(ib)} = nv Using Bump bump_v;
  Transfinite Curve {CF(fi), CR(fi)} = na;
  Transfinite Surface {FS(fi)} = {PF(ia), PR(ia), PR(ib), PF(ib)} Alternate;
Return

// ========================================== blade ==============================================
tw = tu - rf*(1 - Cos(fl));        // half width of the neck
zf = zu + rf*Sin(fl);              // upper end of the fillet
// Root, neck and platform, counter-clockwise from the bottom.
//        0         1      2   3   4   5   6          7        8      9 ... and back by symmetry
pt() = { -(ta-cb),  ta-cb, ta, ta, tu, tw, tw,        tw+chn,  tp,    tp,
         -tp, -tp, -(tw+chn), -tw, -tw, -tu, -ta, -ta };
pz() = { 0,         0,     cb, za, zu, zf, zneck-chn, zneck,   zneck, zneck+hp,
         zneck+hp, zneck, zneck, zneck-chn, zf, zu, za, cb };
sg() = {}; ct() = {}; cz() = {};
For i In {0:17}
  sg() += 0; ct() += 0; cz() += 0;
EndFor
sg(4) = 1;  ct(4)  =  tu + rf*Cos(fl); cz(4)  = zu + rf*Sin(fl);
sg(14)= 1;  ct(14) = -tu - rf*Cos(fl); cz(14) = zu + rf*Sin(fl);
Call Prism;

// Airfoil. Side 0 is the pressure side (concave), side 1 the suction side (convex). Sections are
// parabolic in camber and thickness, stacked on their centroids.
LE0() = {}; LE1() = {}; TE0() = {}; TE1() = {};      // points of the four radial edges
HUB0() = {}; HUB1() = {}; TIP0() = {}; TIP1() = {};  // points of the end sections
For k In {0:nsec-1}
  f  = k/(nsec - 1);
  ch = chord_h + f*(chord_t - chord_h);
  st = (stag_h + f*(stag_t - stag_h))*deg;
  cm = (camb_h + f*(camb_t - camb_h))*ch;
  th = thk_h + f*(thk_t - thk_h);
  ed = edge_h + f*(edge_t - edge_h);
  ecg = cm*(ed*2/3 + (th - ed)*8/15)/(ed + (th - ed)*2/3);
  For m In {0:npts-1}
    If(k == 0 || k == nsec-1 || m == 0 || m == npts-1)
      xi = m/(npts - 1); w4 = 4*xi*(1 - xi);
      For sd In {0:1}
        et = cm*w4 - ecg + (2*sd - 1)*0.5*(ed + (th - ed)*w4);
        p = newp;
        Point(p) = {(xi-0.5)*ch*Cos(st) - et*Sin(st), (xi-0.5)*ch*Sin(st) + et*Cos(st), Rplat + f*height, lc_air};
        If(m == 0 && sd == 0)
          LE0() += p;
        EndIf
        If(m == 0 && sd == 1)
          LE1() += p;
        EndIf
        If(m == npts-1 && sd == 0)
          TE0() += p;
        EndIf
        If(m == npts-1 && sd == 1)
          TE1() += p;
        EndIf
        If(k == 0 && sd == 0)
          HUB0() += p;
        EndIf
        If(k == 0 && sd == 1)
          HUB1() += p;
        EndIf
        If(k == nsec-1 && sd == 0)
          TIP0() += p;
        EndIf
        If(k == nsec-1 && sd == 1)
          TIP1() += p;
        EndIf
      EndFor
    EndIf
  EndFor
EndFor
c = newc; Spline(c) = HUB0(); h0c = c;   c = newc; Spline(c) = HUB1(); h1c = c;
c = newc; Spline(c) = TIP0(); t0c = c;   c = newc; Spline(c) = TIP1(); t1c = c;
c = newc; Spline(c) = LE0();  le0 = c;   c = newc; Spline(c) = LE1();  le1 = c;
c = newc; Spline(c) = TE0();  te0 = c;   c = newc; Spline(c) = TE1();  te1 = c;
c = newc; Line(c) = {LE0(0), LE1(0)}; hle = c;
c = newc; Line(c) = {TE0(0), TE1(0)}; hte = c;
c = newc; Line(c) = {LE0(nsec-1), LE1(nsec-1)}; tle = c;
c = newc; Line(c) = {TE0(nsec-1), TE1(nsec-1)}; tte = c;
l = newll; Curve Loop(l) = {h0c, te0, -t0c, -le0};  s = news; Surface(s) = {l};       sPS = s;
l = newll; Curve Loop(l) = {h1c, te1, -t1c, -le1};  s = news; Surface(s) = {l};       sSS = s;
l = newll; Curve Loop(l) = {hle, le1, -tle, -le0};  s = news; Surface(s) = {l};       sLE = s;
l = newll; Curve Loop(l) = {hte, te1, -tte, -te0};  s = news; Surface(s) = {l};       sTE = s;
l = newll; Curve Loop(l) = {t0c, tte, -t1c, -tle};  s = news; Plane Surface(s) = {l}; sTIP = s;
lhub = newll; Curve Loop(lhub) = {h0c, hte, -h1c, -hle};

FS() = {};
For i In {0:17}
  s = news;
  If(i == 9)
    Plane Surface(s) = {FL(i), lhub};          // top of the platform, with the airfoil's footprint
  ElseIf(sg(i) == 0)
    Plane Surface(s) = {FL(i)};
  Else
    Surface(s) = {FL(i)};
  EndIf
  FS() += s;
EndFor
lf() = {}; lr() = {};
For i In {0:17}
  lf() += SG(i)*CF(i); lr() += SG(i)*CR(i);
EndFor
l = newll; Curve Loop(l) = lf(); s = news; Plane Surface(s) = {l}; bFRONT = s;
l = newll; Curve Loop(l) = lr(); s = news; Plane Surface(s) = {l}; bREAR = s;
fi = 3;  ia = 3;  ib = 4;  Call Flank;   bL = FS(3);
fi = 15; ia = 16; ib = 15; Call Flank;   bR = FS(15);
fi = 4;  ia = 4;  ib = 5;  Call FilletFace;
fi = 14; ia = 15; ib = 14; Call FilletFace;
l = newsl; Surface Loop(l) = {FS(), bFRONT, bREAR, sPS, sSS, sLE, sTE, sTIP};
vB = newv; Volume(vB) = {l};

Physical Volume("blade", 1) = {vB};
Physical Surface("blade_flank_left", 11)  = {bL};
Physical Surface("blade_flank_right", 12) = {bR};
Physical Surface("blade_pressure_side", 13) = {sPS};
Physical Surface("blade_suction_side", 14)  = {sSS};
Physical Surface("blade_edges", 15) = {sLE, sTE};
Physical Surface("blade_tip", 16) = {sTIP};
Physical Surface("blade_root_free", 17) = {FS(0), FS(1), FS(2), FS(4), FS(5), FS(6), FS(7), FS(8), FS(9),
                                           FS(10), FS(11), FS(12), FS(13), FS(14), FS(16), FS(17), bFRONT, bREAR};
Physical Curve("blade_leading_edge", 18) = {le0};
Physical Point("excitation", 1) = {LE0(nsec-1)};           // top of the leading edge, pressure side
Physical Point("tip_trailing_edge", 2) = {TE0(nsec-1)};

// =========================================== jaw ===============================================
tg = ta + rj*(1 - Cos(fl));        // half width of the slot
zg = za - rj*Sin(fl);              // lower end of the fillet under the flank
//        0        1        2   3   4   5   6   7        8      9 ... and back by symmetry
pt() = { -wj,      wj,      wj, tu, tu, ta, tg, tg,      tg-rs, -(tg-rs), -tg, -tg, -ta, -tu, -tu, -wj };
pz() = { -gap-hb,  -gap-hb, zT, zT, zu, za, zg, -gap+rs, -gap,  -gap, -gap+rs, zg, za, zu, zT, zT };
sg() = {}; ct() = {}; cz() = {};
For i In {0:15}
  sg() += 0; ct() += 0; cz() += 0;
EndFor
sg(5)  = 1; ct(5)  =  ta - rj*Cos(fl); cz(5)  = za - rj*Sin(fl);
sg(7)  = 1; ct(7)  =  tg - rs;         cz(7)  = -gap + rs;
sg(9)  = 1; ct(9)  = -(tg - rs);       cz(9)  = -gap + rs;
sg(11) = 1; ct(11) = -ta + rj*Cos(fl); cz(11) = za - rj*Sin(fl);
Call Prism;
FS() = {};
For i In {0:15}
  s = news;
  If(sg(i) == 0)
    Plane Surface(s) = {FL(i)};
  Else
    Surface(s) = {FL(i)};
  EndIf
  FS() += s;
EndFor
lf() = {}; lr() = {};
For i In {0:15}
  lf() += SG(i)*CF(i); lr() += SG(i)*CR(i);
EndFor
l = newll; Curve Loop(l) = lf(); s = news; Plane Surface(s) = {l}; jFRONT = s;
l = newll; Curve Loop(l) = lr(); s = news; Plane Surface(s) = {l}; jREAR = s;
fi = 4;  ia = 5;  ib = 4;  Call Flank;   jL = FS(4);
fi = 12; ia = 12; ib = 13; Call Flank;   jR = FS(12);
fi = 5;  ia = 5;  ib = 6;  Call FilletFace;
fi = 11; ia = 12; ib = 11; Call FilletFace;
fi = 7;  ia = 7;  ib = 8;  Call FilletFace;
fi = 9;  ia = 10; ib = 9;  Call FilletFace;
l = newsl; Surface Loop(l) = {FS(), jFRONT, jREAR};
vJ = newv; Volume(vJ) = {l};

Physical Volume("jaw", 2) = {vJ};
Physical Surface("jaw_flank_left", 21)  = {jL};
Physical Surface("jaw_flank_right", 22) = {jR};
Physical Surface("jaw_base", 23) = {FS(0)};
Physical Surface("jaw_side_left", 24)  = {FS(1)};
Physical Surface("jaw_side_right", 25) = {FS(15)};
Physical Surface("jaw_free", 26) = {FS(2), FS(3), FS(5), FS(6), FS(7), FS(8), FS(9), FS(10), FS(11), FS(13), FS(14), jFRONT, jREAR};

// ====================================== sizes of the mesh ======================================
du = wf/(nu - 1); dv = Ls/(nv - 1);
hf = lc_flank;
If(hf <= 0)
  hf = Sqrt(du*dv);
EndIf
// Distance to the two flanks in the (t, z) plane, as ONE expression: a MathEval field that names
// another MathEval field hangs for ever (Gmsh 4.8.4 and 4.15.2).
T_ = Sprintf("(Abs(%.16g*y - %.16g*x) - %.16g)", Cos(sk), Sin(sk), ta);                // |t| - ta
Z_ = Sprintf("(z - %.16g)", z0 + za);
Q_ = StrCat("(", Z_, Sprintf("*%.16g - ", Cos(fl)), T_, Sprintf("*%.16g)", Sin(fl)));  // along the flank
C_ = StrCat(Sprintf("0.5*(%.16g + Abs", wf), Q_, " - Abs(", Q_, Sprintf(" - %.16g))", wf)); // clamped to [0, wf]
D_ = StrCat("Sqrt((", T_, "+", Sprintf("%.16g*", Sin(fl)), C_, ")^2 + (", Z_, Sprintf(" - %.16g*", Cos(fl)), C_, ")^2)");
Field[5] = MathEval; Field[5].F = StrCat(Sprintf("%.16g + %.16g*", hf, grow), D_);
Field[6] = MathEval; Field[6].F = Sprintf("%.16g", lc);
Field[7] = Min; Field[7].FieldsList = {5, 6};
// Caps: root, neck and platform below Rplat, airfoil above.
Field[8] = Box; Field[8].VIn = lc_root; Field[8].VOut = lc;
Field[8].XMin = -Lx; Field[8].XMax = Lx; Field[8].YMin = -4*tp; Field[8].YMax = 4*tp;
Field[8].ZMin = z0 + zu + rf; Field[8].ZMax = Rplat - 0.01*hp;
Field[9] = Box; Field[9].VIn = lc_air; Field[9].VOut = lc;
Field[9].XMin = -2*chord_t; Field[9].XMax = 2*chord_t; Field[9].YMin = -2*chord_t; Field[9].YMax = 2*chord_t;
Field[9].ZMin = Rplat - 0.01*hp; Field[9].ZMax = Rplat + 2*height;
Field[10] = Distance; Field[10].CurvesList = {le0, le1, te0, te1}; Field[10].NumPointsPerCurve = 400;
Field[11] = Threshold; Field[11].IField = 10; Field[11].LcMin = lc_edge; Field[11].LcMax = lc;
Field[11].DistMin = 0; Field[11].DistMax = (lc - lc_edge)/0.3;
Field[12] = Min; Field[12].FieldsList = {7, 8, 9, 11};
Background Field = 12;

// Delaunay gives the same mesh whenever it is asked, but leaves slivers in fine ones (mean ratio
// 0.06 at 8 x 18, 0.005 at 16 x 36). HXT does not (0.2), but it gives another, equally good mesh with
// another path, environment or number of threads, and crashes on strongly graded flanks.
If(alg3d == 0)
  alg3d = 1;
  If(nu*nv > 144 && bump_u >= 0.2 && bump_v >= 0.2)
    alg3d = 10;
  EndIf
EndIf
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = alg3d;
Mesh.Optimize = 1;
Mesh.OptimizeThreshold = optthr;
Mesh.ElementOrder = order;
Mesh.HighOrderOptimize = 0;        // 1 or 2 would move flank nodes
Mesh.SaveAll = 0;
Mesh.MaxNumThreads1D = 1; Mesh.MaxNumThreads2D = 1; Mesh.MaxNumThreads3D = 1;
