// One of n equal sectors of a disc about the x axis, with a blade on its rim. The sector lies about
// the z axis, and its faces `low` and `high` have the same mesh, turned by one pitch.
DefineConstant[ n = 6, quadratic = 0, layers = 2, lc = 0.02, joined = 1 ];

hub = 0.05;     // radius of the bore, m
rim = 0.12;     // outer radius of the disc, m
width = 0.02;   // along the axis, m
height = 0.08;  // of the blade above the rim, m
blade = 0.4;    // share of the pitch that the blade stands on

pitch = 2 * Pi / n;
beside = (1 - blade) / 2 * pitch;
along = Ceil(width / lc);
radial = Ceil((rim - hub) / lc);

// The low face: a rectangle in the plane of x and z, turned back by half a pitch.
Point(1) = { -width / 2, 0, hub };
Point(2) = {  width / 2, 0, hub };
Point(3) = {  width / 2, 0, rim };
Point(4) = { -width / 2, 0, rim };
Line(1) = { 1, 2 };
Line(2) = { 2, 3 };
Line(3) = { 3, 4 };
Line(4) = { 4, 1 };
Curve Loop(1) = { 1, 2, 3, 4 };
Plane Surface(1) = { 1 };
Rotate { { 1, 0, 0 }, { 0, 0, 0 }, -pitch / 2 } { Surface{ 1 }; }
Transfinite Curve{ 1, 3 } = along + 1;
Transfinite Curve{ 2, 4 } = radial + 1;
Transfinite Surface{ 1 };
Recombine Surface{ 1 };

first() = Extrude { { 1, 0, 0 }, { 0, 0, 0 }, beside } { Surface{ 1 }; Layers{ layers }; Recombine; };
second() = Extrude { { 1, 0, 0 }, { 0, 0, 0 }, blade * pitch } { Surface{ first(0) }; Layers{ layers }; Recombine; };
third() = Extrude { { 1, 0, 0 }, { 0, 0, 0 }, beside } { Surface{ second(0) }; Layers{ layers }; Recombine; };
// The sides of an extrusion come in the order of the lines: bore is that of line 1, rim of line 3.
seat = second(4);
foot = seat;
If (!joined)
  // The blade is a body of its own, whose foot lies on the rim node by node: what coincides is not merged.
  Geometry.AutoCoherence = 0;
  edge = newp;
  Point(edge) = { -width / 2, 0, rim };
  Point(edge + 1) = { width / 2, 0, rim };
  base = newc;
  Line(base) = { edge, edge + 1 };
  Rotate { { 1, 0, 0 }, { 0, 0, 0 }, -blade * pitch / 2 } { Curve{ base }; }
  Transfinite Curve{ base } = along + 1;
  swept() = Extrude { { 1, 0, 0 }, { 0, 0, 0 }, blade * pitch } { Curve{ base }; Layers{ layers }; Recombine; };
  foot = swept(1);
EndIf
on_rim() = Extrude { 0, 0, height } { Surface{ foot }; Layers{ Ceil(height / lc) }; Recombine; };

If (joined)
  Physical Volume("disc") = { first(1), second(1), third(1), on_rim(1) };
Else
  Physical Volume("disc") = { first(1), second(1), third(1) };
  Physical Volume("blade") = { on_rim(1) };
  Physical Surface("seat") = { seat };
  Physical Surface("foot") = { foot };
EndIf
Physical Surface("low") = { 1 };
Physical Surface("high") = { third(0) };
Physical Surface("bore") = { first(2), second(2), third(2) };
Physical Surface("tip") = { on_rim(0) };

Mesh.ElementOrder = 1 + quadratic;
Mesh.SecondOrderIncomplete = 1;
Mesh.MshFileVersion = 4.1;
