// dovetail_hex.geo - the joint of dovetail.geo, its attachment and its airfoil of hexahedra
//
// The same two bodies: dimensions, groups and the nodes on the flanks are those of dovetail.geo. Jaw,
// root, neck and airfoil are hexahedra. The platform between neck and airfoil is of tetrahedra: the
// airfoil's footprint does not fit the layers along the slot. Where they meet it, the hexahedra of the
// uppermost row of the neck and of the lowest of the airfoil are divided into pyramids and tetrahedra.
//
// Units: mm. Axes and slot frame: as in dovetail.geo.
//
// Run:  gmsh -3 dovetail_hex.geo -nt 1 -setnumber nu 8 -setnumber nv 18 -format msh41 -bin -o dovetail_hex.msh
// Needs Gmsh 4.8 or later (built-in kernel only).
//
// Every point, curve, surface and volume is written out (no Extrude, which would weld the bodies). The
// profiles of root and jaw are grids of blocks, each carried along the slot as one transfinite volume.
SetFactory("Built-in");

DefineConstant[
  // --- mesh -----------------------------------------------------------------------------------
  nu      = 4,      // corner nodes across a flank, from its lower to its upper edge
  nv      = 9,      // corner nodes along a flank
  bump    = 1,      // edge grading of the flanks: 1 uniform, < 1 refines towards all four edges
  bump_u  = bump,   //   the same, across only
  bump_v  = bump,   //   the same, along only
  order   = 2,      // element order: 1 (8 nodes a hexahedron) or 2 (20)
  lc      = 6,      // largest size in the jaw, across the slot
  lc_root = 3,      // largest size in root, neck (across the slot) and platform
  lc_air  = 2.5,    // size in the airfoil, along chord and height
  n_thk   = 2,      // elements across the thickness of the airfoil
  bump_air= 0.3,    // edge grading of the airfoil along its chord
  grow    = 0.35,   // growth of the size from one element to the next, away from the slot
  nfil    = 2,      // at least this many elements per 45 degrees of a fillet
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
  Error("dovetail_hex.geo: nu = %.10g, nv = %.10g: whole numbers of corner nodes, at least 2 x 2 a flank", nu, nv); Exit;
EndIf
If(npts < 2 || nsec < 2 || npts != Floor(npts) || nsec != Floor(nsec))
  Error("dovetail_hex.geo: npts = %.10g, nsec = %.10g: whole numbers of points and sections, at least 2", npts, nsec); Exit;
EndIf
If(order != 1 && order != 2)
  Error("dovetail_hex.geo: order = %g: 1 or 2", order); Exit;
EndIf
If(bump_u <= 0 || bump_v <= 0 || bump_air <= 0)
  Error("dovetail_hex.geo: bump_u = %g, bump_v = %g, bump_air = %g: must be positive", bump_u, bump_v, bump_air); Exit;
EndIf
If(lc <= 0 || lc_root <= 0 || lc_air <= 0 || grow <= 0 || n_thk < 1 || n_thk != Floor(n_thk))
  Error("dovetail_hex.geo: lc = %g, lc_root = %g, lc_air = %g, grow = %g: must be positive; n_thk = %g: a whole number from 1", lc, lc_root, lc_air, grow, n_thk); Exit;
EndIf
If(skew == 0)
  Error("dovetail_hex.geo: skew = 0: the fillets are arcs of ellipses and need a slot that is not axial"); Exit;
EndIf
If(za - rj*Sin(fl) <= -gap + rs || tu - rf*(1 - Cos(fl)) <= 0 || zT >= zneck || zu + rf*Sin(fl) >= zneck - chn || cb >= za || wj <= ta + rj*(1 - Cos(fl)) + rs)
  Error("dovetail_hex.geo: the dimensions of the attachment do not fit together"); Exit;
EndIf

// ---------------------------------------------------------------------------------------------
Macro Grid
  // Blocks between the vertices of a grid in (t, z), carried along the slot between the end planes.
  // in : ni columns and nj rows of vertices, vertex (i, j) = i + ni*j at pt(), pz();
  //      nh(i) nodes and gh(i) progression of the edges from column i to i + 1, nw(j) nodes and
  //      bw(j) bump of the edges from row j to j + 1; sg() = 1 at vertex (i, j) where the edge from it
  //      to (i, j + 1) is an arc about (ct(), cz())
  //      topmost of the surfaces SH() at the end stay of triangles
  // out: PF(), PR() points of the front and rear ends; SF(), SR() surfaces of the ends;
  //      SH(i + (ni-1)*j), SW(i + ni*j) surfaces of the two kinds of edges; HF(), HR(), LS() curves
  //      of the edges from column to column and along the slot; VOL() volumes
  PF() = {}; PR() = {}; LS() = {}; HF() = {}; HR() = {}; WF() = {}; WR() = {}; WS() = {};
  SF() = {}; SR() = {}; SH() = {}; SW() = {}; VOL() = {};
  For k In {0:ni*nj-1}
    For e In {0:1}
      s = (e - 0.5)*Ls + pt(k)*Tan(sk);
      p = newp;
      Point(p) = {s*Cos(sk) - pt(k)*Sin(sk), s*Sin(sk) + pt(k)*Cos(sk), z0 + pz(k), lc_root};
      If(e == 0)
        PF() += p;
      Else
        PR() += p;
      EndIf
    EndFor
    c = newc; Line(c) = {PF(k), PR(k)}; LS() += c;
    Transfinite Curve {c} = nv Using Bump bump_v;
  EndFor
  For j In {0:nj-1}
    For i In {0:ni-2}
      k = i + ni*j;
      c = newc; Line(c) = {PF(k), PF(k+1)}; HF() += c; Transfinite Curve {c} = nh(i) Using Progression gh(i);
      c = newc; Line(c) = {PR(k), PR(k+1)}; HR() += c; Transfinite Curve {c} = nh(i) Using Progression gh(i);
      n = #HF() - 1;
      l = newll; Curve Loop(l) = {HF(n), LS(k+1), -HR(n), -LS(k)};
      s = news; Surface(s) = {l}; SH() += s;
      Transfinite Surface {s} = {PF(k), PF(k+1), PR(k+1), PR(k)};
    EndFor
  EndFor
  For j In {0:nj-2}
    For i In {0:ni-1}
      // Upwards, then towards +t: one direction for both bodies.
      a = i + ni*j; b = a + ni; sgn = 1;
      If(pz(a) > pz(b) + 1e-9 || (Fabs(pz(a) - pz(b)) <= 1e-9 && pt(a) > pt(b)))
        a = b; b = i + ni*j; sgn = -1;
      EndIf
      WS() += sgn;
      k = i + ni*j;
      For e In {0:1}
        If(e == 0)
          pa = PF(a); pb = PF(b);
        Else
          pa = PR(a); pb = PR(b);
        EndIf
        If(sg(k) == 0)
          c = newc; Line(c) = {pa, pb};
        Else
          // A circle about the slot direction, cut by a plane x = const: an ellipse, longer in y.
          s = (e - 0.5)*Ls + ct(k)*Tan(sk);
          p = newp;
          Point(p) = {s*Cos(sk) - ct(k)*Sin(sk), s*Sin(sk) + ct(k)*Cos(sk), z0 + cz(k), lc_root};
          rr = Sqrt((pt(k)-ct(k))^2 + (pz(k)-cz(k))^2);
          s = (e - 0.5)*Ls + (ct(k)+rr)*Tan(sk); q = newp;
          Point(q) = {s*Cos(sk) - (ct(k)+rr)*Sin(sk), s*Sin(sk) + (ct(k)+rr)*Cos(sk), z0 + cz(k), lc_root};
          c = newc; Ellipse(c) = {pa, p, q, pb};
        EndIf
        Transfinite Curve {c} = nw(j) Using Bump bw(j);
        If(e == 0)
          WF() += c;
        Else
          WR() += c;
        EndIf
      EndFor
      l = newll; Curve Loop(l) = {WF(k), LS(b), -WR(k), -LS(a)};
      s = news; Surface(s) = {l}; SW() += s;
      Transfinite Surface {s} = {PF(a), PR(a), PR(b), PF(b)};
    EndFor
  EndFor
  For j In {0:nj-2}
    For i In {0:ni-2}
      k = i + ni*j; m = i + (ni-1)*j;
      l = newll; Curve Loop(l) = {HF(m), WS(k+1)*WF(k+1), -HF(m+ni-1), -WS(k)*WF(k)};
      s = news; Plane Surface(s) = {l}; SF() += s;
      Transfinite Surface {s} = {PF(k), PF(k+1), PF(k+1+ni), PF(k+ni)};
      l = newll; Curve Loop(l) = {HR(m), WS(k+1)*WR(k+1), -HR(m+ni-1), -WS(k)*WR(k)};
      s = news; Plane Surface(s) = {l}; SR() += s;
      Transfinite Surface {s} = {PR(k), PR(k+1), PR(k+1+ni), PR(k+ni)};
      l = newsl; Surface Loop(l) = {SF(m), SR(m), SH(m), SH(m+ni-1), SW(k), SW(k+1)};
      v = newv; Volume(v) = {l}; VOL() += v;
      Transfinite Volume {v} = {PF(k), PF(k+1), PF(k+1+ni), PF(k+ni), PR(k), PR(k+1), PR(k+1+ni), PR(k+ni)};
    EndFor
  EndFor
  Recombine Surface {SF(), SR(), SW()};
  For m In {0:#SH()-1-topmost}
    Recombine Surface {SH(m)};
  EndFor
Return

// ======================================= numbers of nodes ========================================
du = wf/(nu - 1); dv = Ls/(nv - 1);
hs = Min(1.5*du, lc_root);            // size across the slot, next to the flanks
hfil = Max(hs, Sqrt(du*dv));          // largest size along a fillet
Macro Counts
  // in : len() lengths, size; out: num() nodes on each, at least two
  num() = {};
  For k In {0:#len()-1}
    num() += 1 + Max(1, Floor(len(k)/size + 0.5));
  EndFor
Return
// Away from the flanks the size grows from 0.75 hs.
nrad = Max(Ceil(Log(1 + (wj - ta)*grow/(0.75*hs))/Log(1 + grow) - 1e-6), Ceil((wj - ta)/lc - 1e-6));
nside = Max(Ceil(Log(1 + 0.5*ta*grow/(0.75*hs))/Log(1 + grow) - 1e-6), Ceil(0.5*ta/lc_root - 1e-6));
nrf = 1 + Max(Ceil(nfil*flankdeg/45 - 1e-6), Ceil(rf*fl/hfil - 1e-6));
nrj = 1 + Max(Ceil(nfil*flankdeg/45 - 1e-6), Ceil(rj*fl/hfil - 1e-6));
nrs = 1 + Max(Ceil(nfil - 1e-6), Ceil(rs*Pi/4/hfil - 1e-6));   // half of it

// ========================================== blade ==============================================
tw = tu - rf*(1 - Cos(fl));        // half width of the neck
zf = zu + rf*Sin(fl);              // upper end of the fillet
// Rows of the grid, from the bottom to the underside of the platform, and half widths of its middle
// column; that column's row beside the flank begins and ends lower than the flank, which evens the angles.
//         bottom    chamfer   A        B        fillet    neck       platform
rt() = { ta-cb,      ta,       ta,      tu,      tw,       tw,        tw+chn };
rz() = { 0,          cb,       za,      zu,      zf,       zneck-chn, zneck };
mt() = { 0.4*ta,     0.4*ta,   0.4*ta,  0.4*tu,  0.4*tw,   0.4*tw,    0.4*(tw+chn) };
mz() = { 0,          0.7*cb,   0.7*za,  zu-0.2*wf,  zf-0.15*wf, zneck-chn, zneck };
ni = 4; nj = 7; topmost = 3;
pt() = {}; pz() = {}; sg() = {}; ct() = {}; cz() = {};
For j In {0:nj-1}
  pt() += {-rt(j), -mt(j), mt(j), rt(j)};
  pz() += {rz(j), mz(j), mz(j), rz(j)};
  For i In {0:3}
    sg() += 0; ct() += 0; cz() += 0;
  EndFor
EndFor
sg(12) = 1; ct(12) = -tu - rf*Cos(fl); cz(12) = zu + rf*Sin(fl);
sg(15) = 1; ct(15) =  tu + rf*Cos(fl); cz(15) = zu + rf*Sin(fl);
len() = {0.8*ta}; size = lc_root;
Call Counts;
nh() = {1 + nside, num(0), 1 + nside};       gh() = {1 + grow, 1, 1/(1 + grow)};
len() = {cb, za - cb, zneck - chn - zf, chn}; size = Min(1.5*hs, lc_root);
Call Counts;
nw() = {num(0), num(1), nu, nrf, num(2), num(3)}; bw() = {1, 1, bump_u, 1, 1, 1};
Call Grid;
bVol() = VOL();
TransfQuadTri {VOL(15), VOL(16), VOL(17)};
bL = SW(11); bR = SW(8);
bFree() = {SF(), SR(), SH(0), SH(1), SH(2), SW(0), SW(3), SW(4), SW(7), SW(12), SW(15), SW(16), SW(19), SW(20), SW(23)};
// The underside of the platform: its curves at the ends, points and curves along its edges, quadrilaterals.
uHF() = {HF(18), HF(19), HF(20)}; uHR() = {HR(18), HR(19), HR(20)};
uP() = {PF(24), PR(24), PF(27), PR(27)}; uL() = {LS(24), LS(27)}; uS() = {SH(18), SH(19), SH(20)};

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
        Point(p) = {(xi-0.5)*ch*Cos(st) - et*Sin(st), (xi-0.5)*ch*Sin(st) + et*Cos(st), Rplat + f*height, lc_root};
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
s = news; Plane Surface(s) = {lhub}; sHUB = s;
Transfinite Curve {h0c, h1c, t0c, t1c} = 1 + Ceil(Max(chord_h, chord_t)/lc_air - 1e-6) Using Bump bump_air;
Transfinite Curve {hle, hte, tle, tte} = 1 + n_thk;
Transfinite Curve {le0, le1, te0, te1} = 1 + Ceil(height/lc_air - 1e-6);
Transfinite Surface {sPS} = {HUB0(0), TE0(0), TE0(nsec-1), LE0(nsec-1)};
Transfinite Surface {sSS} = {HUB1(0), TE1(0), TE1(nsec-1), LE1(nsec-1)};
Transfinite Surface {sLE} = {LE0(0), LE1(0), LE1(nsec-1), LE0(nsec-1)};
Transfinite Surface {sTE} = {TE0(0), TE1(0), TE1(nsec-1), TE0(nsec-1)};
Transfinite Surface {sTIP} = {LE0(nsec-1), TE0(nsec-1), TE1(nsec-1), LE1(nsec-1)};
Transfinite Surface {sHUB} = {LE0(0), TE0(0), TE1(0), LE1(0)};
Recombine Surface {sPS, sSS, sLE, sTE, sTIP};
l = newsl; Surface Loop(l) = {sPS, sSS, sLE, sTE, sTIP, sHUB};
vA = newv; Volume(vA) = {l};
TransfQuadTri {vA};
Transfinite Volume {vA} = {LE0(0), TE0(0), TE1(0), LE1(0), LE0(nsec-1), TE0(nsec-1), TE1(nsec-1), LE1(nsec-1)};

// Platform: corners at -t and +t, underside and top, front and rear.
qF() = {}; qR() = {}; qS() = {};
For k In {0:3}
  t = (k == 0 || k == 3) ? -tp : tp;
  z = (k < 2) ? zneck : zneck + hp;
  For e In {0:1}
    s = (e - 0.5)*Ls + t*Tan(sk);
    p = newp;
    Point(p) = {s*Cos(sk) - t*Sin(sk), s*Sin(sk) + t*Cos(sk), z0 + z, lc_root};
    If(e == 0)
      qF() += p;
    Else
      qR() += p;
    EndIf
  EndFor
  c = newc; Line(c) = {qF(k), qR(k)}; qS() += c;
EndFor
pS() = {}; pFree() = {};
qCF() = {}; qCR() = {};
c = newc; Line(c) = {uP(2), qF(1)}; qCF() += c;   c = newc; Line(c) = {uP(3), qR(1)}; qCR() += c;
c = newc; Line(c) = {qF(1), qF(2)}; qCF() += c;   c = newc; Line(c) = {qR(1), qR(2)}; qCR() += c;
c = newc; Line(c) = {qF(2), qF(3)}; qCF() += c;   c = newc; Line(c) = {qR(2), qR(3)}; qCR() += c;
c = newc; Line(c) = {qF(3), qF(0)}; qCF() += c;   c = newc; Line(c) = {qR(3), qR(0)}; qCR() += c;
c = newc; Line(c) = {qF(0), uP(0)}; qCF() += c;   c = newc; Line(c) = {qR(0), uP(1)}; qCR() += c;
l = newll; Curve Loop(l) = {uHF(), qCF()};                          s = news; Plane Surface(s) = {l}; pFree() += s;
l = newll; Curve Loop(l) = {uHR(), qCR()};                          s = news; Plane Surface(s) = {l}; pFree() += s;
l = newll; Curve Loop(l) = {qCF(0), qS(1), -qCR(0), -uL(1)};        s = news; Plane Surface(s) = {l}; pFree() += s;
l = newll; Curve Loop(l) = {qCF(1), qS(2), -qCR(1), -qS(1)};        s = news; Plane Surface(s) = {l}; pFree() += s;
l = newll; Curve Loop(l) = {qCF(2), qS(3), -qCR(2), -qS(2)};        s = news; Plane Surface(s) = {l, lhub}; pFree() += s;
l = newll; Curve Loop(l) = {qCF(3), qS(0), -qCR(3), -qS(3)};        s = news; Plane Surface(s) = {l}; pFree() += s;
l = newll; Curve Loop(l) = {qCF(4), uL(0), -qCR(4), -qS(0)};        s = news; Plane Surface(s) = {l}; pFree() += s;
l = newsl; Surface Loop(l) = {uS(), pFree(), sHUB};
vP = newv; Volume(vP) = {l};

Physical Volume("blade", 1) = {bVol(), vP, vA};
Physical Surface("blade_flank_left", 11)  = {bL};
Physical Surface("blade_flank_right", 12) = {bR};
Physical Surface("blade_pressure_side", 13) = {sPS};
Physical Surface("blade_suction_side", 14)  = {sSS};
Physical Surface("blade_edges", 15) = {sLE, sTE};
Physical Surface("blade_tip", 16) = {sTIP};
Physical Surface("blade_root_free", 17) = {bFree(), pFree()};
Physical Curve("blade_leading_edge", 18) = {le0};
Physical Point("excitation", 1) = {LE0(nsec-1)};           // top of the leading edge, pressure side
Physical Point("tip_trailing_edge", 2) = {TE0(nsec-1)};

// =========================================== jaw ===============================================
tg = ta + rj*(1 - Cos(fl));        // half width of the slot
zg = za - rj*Sin(fl);              // lower end of the fillet under the flank
tm = tg - rs*(1 - Cos(Pi/4));      // middle of the fillet at the floor
zm = -gap + rs*(1 - Sin(Pi/4));
zB = -gap - hb;                    // bottom
// A ring of blocks around the slot: its wall, from the top on the right to the top on the left, and
// opposite each point of it one of the outside.
//         top  B    A    fillet  wall     middle  floor
rt() = { tu,  tu,  ta,  tg,  tg,       tm,  tg-rs };
rz() = { zT,  zu,  za,  zg,  -gap+rs,  zm,  -gap };
ot() = { wj,  wj,  wj,  wj,  wj,       wj,  tg-rs };
oz() = { zT,  zT-0.3*(zT-zm), zT-0.5*(zT-zm), zT-0.8*(zT-zm), zm-0.1*(zm-zB), zB, zB };
ni = 2; nj = 14; topmost = 0;
pt() = {}; pz() = {}; sg() = {}; ct() = {}; cz() = {};
For j In {0:nj-1}
  k = j; sd = 1;
  If(j > 6)
    k = 13 - j; sd = -1;
  EndIf
  pt() += {sd*rt(k), sd*ot(k)};
  pz() += {rz(k), oz(k)};
  For i In {0:1}
    sg() += 0; ct() += 0; cz() += 0;
  EndFor
EndFor
For sd In {0:1}
  k = sd ? 20 : 4;   sg(k) = 1; ct(k) = (1-2*sd)*(ta - rj*Cos(fl)); cz(k) = za - rj*Sin(fl);
  k = sd ? 16 : 8;   sg(k) = 1; ct(k) = (1-2*sd)*(tg - rs);         cz(k) = -gap + rs;
  k = sd ? 14 : 10;  sg(k) = 1; ct(k) = (1-2*sd)*(tg - rs);         cz(k) = -gap + rs;
EndFor
nh() = {1 + nrad}; gh() = {1 + grow};
len() = {lip, zg + gap - rs}; size = hs;
Call Counts;
half() = {num(0), nu, nrj, num(1), nrs, nrs};
len() = {2*(tg - rs)}; size = Min(1.5*hs, lc);
Call Counts;
nw() = {half(), num(0), half(5), half(4), half(3), half(2), half(1), half(0)};
bw() = {1, bump_u, 1, 1, 1, 1, 1, 1, 1, 1, 1, bump_u, 1};
Call Grid;
jL = SW(2); jR = SW(22);

Physical Volume("jaw", 2) = {VOL()};
Physical Surface("jaw_flank_left", 21)  = {jL};
Physical Surface("jaw_flank_right", 22) = {jR};
Physical Surface("jaw_base", 23) = {SW(11), SW(13), SW(15)};
Physical Surface("jaw_side_left", 24)  = {SW(1), SW(3), SW(5), SW(7), SW(9)};
Physical Surface("jaw_side_right", 25) = {SW(17), SW(19), SW(21), SW(23), SW(25)};
Physical Surface("jaw_free", 26) = {SF(), SR(), SH(0), SH(13), SW(0), SW(4), SW(6), SW(8), SW(10), SW(12), SW(14),
                                    SW(16), SW(18), SW(20), SW(24)};

// ====================================== sizes of the mesh ======================================
// In the platform, from its boundary inwards; no larger than lc_root.
Mesh.MeshSizeFromPoints = 1;
Mesh.MeshSizeFromCurvature = 0;
Mesh.MeshSizeExtendFromBoundary = 1;
Mesh.MeshSizeMax = lc_root;
Mesh.Algorithm = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.ElementOrder = order;
Mesh.SecondOrderIncomplete = 1;    // 20, 13 nodes: none inside faces and elements
Mesh.HighOrderOptimize = 0;        // 1 or 2 would move flank nodes
Mesh.SaveAll = 0;
Mesh.MaxNumThreads1D = 1; Mesh.MaxNumThreads2D = 1; Mesh.MaxNumThreads3D = 1;
