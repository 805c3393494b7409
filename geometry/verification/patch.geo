// patch.geo - two prisms on an irregular quadrilateral, one on the other, their flanks meshed unevenly
//
// The bodies share nothing: the flanks lie on each other node for node, every node exists twice. Lengths in mm.
//
// Run: gmsh -3 patch.geo -nt 1 -format msh41 -bin -o patch.msh      Needs Gmsh 4.8 or later.
SetFactory("Built-in");
DefineConstant[
  nx    = 5,     // elements along x on the flank
  ny    = 4,     //          along y
  ratio = 1.35,  // of neighbouring elements
  lc    = 4,     // size away from the flank
  shape = 4,     // corners of an element: 4 tetrahedra, 6 wedges on triangles, 8 hexahedra
  order = 2
];
If(nx < 1 || ny < 1 || ratio <= 0 || lc <= 0)
  Error("patch.geo: nx = %g, ny = %g, ratio = %g, lc = %g: nx, ny at least 1, ratio and lc above 0", nx, ny, ratio, lc); Exit;
EndIf
If(shape != 4 && shape != 6 && shape != 8)
  Error("patch.geo: shape = %g: 4, 6 or 8", shape); Exit;
EndIf

Macro Prism
  // From z = 0 to z = zt; out: flank, far, vol, p() at z = 0, q() at z = zt
  p() = {}; q() = {};
  v = newp; Point(v) = {0, 0, 0};   p() += v;   v = newp; Point(v) = {10, 1, 0};  p() += v;
  v = newp; Point(v) = {12, 9, 0};  p() += v;   v = newp; Point(v) = {0, 7, 0};  p() += v;
  v = newp; Point(v) = {0, 0, zt};  q() += v;   v = newp; Point(v) = {10, 1, zt}; q() += v;
  v = newp; Point(v) = {12, 9, zt}; q() += v;   v = newp; Point(v) = {0, 7, zt}; q() += v;
  a() = {}; b() = {}; u() = {};
  For i In {0:3}
    v = newc; Line(v) = {p(i), p((i+1)%4)}; a() += v;
    v = newc; Line(v) = {q(i), q((i+1)%4)}; b() += v;
    v = newc; Line(v) = {p(i), q(i)};       u() += v;
  EndFor
  Transfinite Curve {a(0)} = nx + 1 Using Progression ratio;
  Transfinite Curve {a(2)} = nx + 1 Using Progression ratio;
  Transfinite Curve {a(1)} = ny + 1 Using Progression ratio;
  Transfinite Curve {a(3)} = ny + 1;
  l = newll; Curve Loop(l) = {a()};  flank = news; Plane Surface(flank) = {l};
  l = newll; Curve Loop(l) = {b()};  far = news; Plane Surface(far) = {l};
  Transfinite Surface {flank} = {p()};
  all() = {flank, far};
  For i In {0:3}
    l = newll; Curve Loop(l) = {a(i), u((i+1)%4), -b(i), -u(i)};
    v = news; Plane Surface(v) = {l}; all() += v;
  EndFor
  l = newsl; Surface Loop(l) = {all()}; vol = newv; Volume(vol) = {l};
  If(shape > 4)
    // Layers from the flank to the far end: its grid, graded alike, on both.
    Transfinite Curve {b(0)} = nx + 1 Using Progression ratio;
    Transfinite Curve {b(2)} = nx + 1 Using Progression ratio;
    Transfinite Curve {b(1)} = ny + 1 Using Progression ratio;
    Transfinite Curve {b(3)} = ny + 1;
    Transfinite Curve {u()} = 4;
    Transfinite Surface {far} = {q()};
    For i In {0:3}
      Transfinite Surface {all(2+i)};
      Recombine Surface {all(2+i)};
    EndFor
    If(shape == 8)
      Recombine Surface {flank, far};
    EndIf
    Transfinite Volume {vol} = {p(), q()};
  EndIf
Return

zt = 8;  Call Prism;
Physical Volume("upper") = {vol};
Physical Surface("upper_flank") = {flank};
Physical Surface("upper_top") = {far};
Physical Point("upper_corner") = {q(2)};
zt = -6; Call Prism;
Physical Volume("lower") = {vol};
Physical Surface("lower_flank") = {flank};
Physical Surface("lower_base") = {far};
Physical Point("lower_anchor") = {q(0)};
Physical Point("lower_rail") = {q(3)};

Mesh.CharacteristicLengthMin = lc/4; Mesh.CharacteristicLengthMax = lc;
Mesh.Algorithm = 6; Mesh.Algorithm3D = 1; Mesh.Optimize = 1;
Mesh.MaxNumThreads1D = 1; Mesh.MaxNumThreads2D = 1; Mesh.MaxNumThreads3D = 1;
Mesh.ElementOrder = order;
Mesh.SecondOrderIncomplete = 1;
Mesh.SecondOrderLinear = 1;
Mesh.SaveAll = 0;
