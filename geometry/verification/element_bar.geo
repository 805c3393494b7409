// element_bar.geo - a twisted, tapered, bent bar whose elements are all distorted
//
// One body for comparisons of element types: its long edges and those of its sections are curved, and the
// divisions of opposite edges are graded against each other, so that no element is a brick. Lengths in mm.
//
// Run: gmsh -3 element_bar.geo -nt 1 -setnumber shape 8 -format msh41 -bin -o bar.msh      Needs Gmsh 4.8 or later.
SetFactory("Built-in");
DefineConstant[
  shape  = 8,    // corners of an element: 4 tetrahedra, 6 wedges, 8 hexahedra
  nx     = 4,    // elements across the long side of a section
  ny     = 2,    //          across the short side
  nz     = 10,   //          along the bar
  ratio  = 2,    // of the elements at the two ends of an edge that is graded
  length = 60,
  twist  = 40,   // of the end against the root, degrees
  a      = 20,   // long side of the section at the root
  b      = 6,    // short side there
  taper  = 0.6,  // of both at the end
  camber = 0.12, // of the long sides, over their length
  nsec   = 7,    // points of the long edges
  order  = 2
];
If((shape != 4 && shape != 6 && shape != 8) || (order != 1 && order != 2))
  Error("element_bar.geo: shape = %g, order = %g: shape 4, 6 or 8, order 1 or 2", shape, order); Exit;
EndIf
If(nx < 1 || ny < 1 || nz < 1 || nsec < 2 || nx != Floor(nx) || ny != Floor(ny) || nz != Floor(nz) || nsec != Floor(nsec))
  Error("element_bar.geo: nx = %g, ny = %g, nz = %g, nsec = %g: whole numbers from 1, nsec from 2", nx, ny, nz, nsec); Exit;
EndIf
If(length <= 0 || a <= 0 || b <= 0 || taper <= 0 || ratio <= 0)
  Error("element_bar.geo: length = %g, a = %g, b = %g, taper = %g, ratio = %g: must be positive", length, a, b, taper, ratio); Exit;
EndIf

// Corners (-a, -b), (a, -b), (a, b), (-a, b) of the sections, and the middles of the two long sides.
E0() = {}; E1() = {}; E2() = {}; E3() = {}; M() = {};
For k In {0:nsec-1}
  f = k/(nsec - 1);
  c = Cos(twist*Pi/180*f); s = Sin(twist*Pi/180*f); g = 1 + f*(taper - 1);
  For i In {0:5}
    x = 0.5*a*g*((i == 1 || i == 2) - (i == 0 || i == 3));
    y = 0.5*b*g*((i == 2 || i == 3 || i == 5) - (i == 0 || i == 1 || i == 4)) + camber*a*g*(i >= 4);
    If(i < 4 || k == 0 || k == nsec-1)
      p = newp; Point(p) = {x*c - y*s, x*s + y*c, length*f};
    EndIf
    If(i == 0)
      E0() += p;
    EndIf
    If(i == 1)
      E1() += p;
    EndIf
    If(i == 2)
      E2() += p;
    EndIf
    If(i == 3)
      E3() += p;
    EndIf
    If(i >= 4 && (k == 0 || k == nsec-1))
      M() += p;
    EndIf
  EndFor
EndFor
c = newc; Spline(c) = E0(); e0 = c;   c = newc; Spline(c) = E1(); e1 = c;
c = newc; Spline(c) = E2(); e2 = c;   c = newc; Spline(c) = E3(); e3 = c;
t = nsec - 1;
c = newc; Spline(c) = {E0(0), M(0), E1(0)}; r0 = c;   c = newc; Line(c) = {E1(0), E2(0)}; r1 = c;
c = newc; Spline(c) = {E3(0), M(1), E2(0)}; r2 = c;   c = newc; Line(c) = {E0(0), E3(0)}; r3 = c;
c = newc; Spline(c) = {E0(t), M(2), E1(t)}; t0 = c;   c = newc; Line(c) = {E1(t), E2(t)}; t1 = c;
c = newc; Spline(c) = {E3(t), M(3), E2(t)}; t2 = c;   c = newc; Line(c) = {E0(t), E3(t)}; t3 = c;
qx = ratio^(1/nx); qz = ratio^(1/nz);
Transfinite Curve {e0, e2} = nz + 1 Using Progression qz;
Transfinite Curve {e1, e3} = nz + 1 Using Progression 1/qz;
Transfinite Curve {r0, t2} = nx + 1 Using Progression qx;
Transfinite Curve {r2, t0} = nx + 1 Using Progression 1/qx;
Transfinite Curve {r1, r3, t1, t3} = ny + 1;

l = newll; Curve Loop(l) = {r0, r1, -r2, -r3}; v = news; Plane Surface(v) = {l}; root = v;
l = newll; Curve Loop(l) = {t0, t1, -t2, -t3}; v = news; Plane Surface(v) = {l}; end = v;
l = newll; Curve Loop(l) = {r0, e1, -t0, -e0}; v = news; Surface(v) = {l}; s0 = v;
l = newll; Curve Loop(l) = {r1, e2, -t1, -e1}; v = news; Surface(v) = {l}; s1 = v;
l = newll; Curve Loop(l) = {r2, e2, -t2, -e3}; v = news; Surface(v) = {l}; s2 = v;
l = newll; Curve Loop(l) = {r3, e3, -t3, -e0}; v = news; Surface(v) = {l}; s3 = v;
Transfinite Surface {root} = {E0(0), E1(0), E2(0), E3(0)};
Transfinite Surface {end} = {E0(t), E1(t), E2(t), E3(t)};
Transfinite Surface {s0} = {E0(0), E1(0), E1(t), E0(t)};
Transfinite Surface {s1} = {E1(0), E2(0), E2(t), E1(t)};
Transfinite Surface {s2} = {E3(0), E2(0), E2(t), E3(t)};
Transfinite Surface {s3} = {E0(0), E3(0), E3(t), E0(t)};
If(shape >= 6)
  Recombine Surface {s0, s1, s2, s3};
EndIf
If(shape == 8)
  Recombine Surface {root, end};
EndIf
l = newsl; Surface Loop(l) = {root, end, s0, s1, s2, s3};
v = newv; Volume(v) = {l};
Transfinite Volume {v} = {E0(0), E1(0), E2(0), E3(0), E0(t), E1(t), E2(t), E3(t)};

Physical Volume("bar") = {v};
Physical Surface("bar_root") = {root};
Physical Surface("bar_end") = {end};
Physical Surface("bar_sides") = {s0, s1, s2, s3};
Physical Point("bar_corners") = {E0(t), E1(t), E2(t), E3(t)};

Mesh.ElementOrder = order;
Mesh.SecondOrderIncomplete = 1;
Mesh.HighOrderOptimize = 0;
Mesh.SaveAll = 0;
Mesh.MaxNumThreads1D = 1; Mesh.MaxNumThreads2D = 1; Mesh.MaxNumThreads3D = 1;
