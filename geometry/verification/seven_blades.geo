// One of seven equal sectors of a plate with seven straight blades, 3 mm thick, about the z axis: the disc of the
// example "Cyclic Analysis" of the documentation of PyMAPDL, ANSYS, Inc. There the sectors meet on the axis; here a
// heptagon around it is left open.
DefineConstant[ across = 8, along = 43, inward = 10, layers = 3, hole = 0.25e-3 ];

hub = 0.01;         // circumscribed radius of the heptagon that the blades stand on, m
reach = 0.052;      // radius of the corners of the tips, m
thickness = 0.003;  // along the axis, m

pitch = 2 * Pi / 7;
// The chord of a side of the heptagon is bent onto the tip: half the angle there.
half = hub * Sin(pitch / 2) / reach;

Point(1) = { hole, 0, 0 };
Point(2) = { hub, 0, 0 };
Point(3) = { hub * Cos(pitch), hub * Sin(pitch), 0 };
Point(4) = { hole * Cos(pitch), hole * Sin(pitch), 0 };
Point(5) = { reach * Cos(pitch / 2 - half), reach * Sin(pitch / 2 - half), 0 };
Point(6) = { reach * Cos(pitch / 2 + half), reach * Sin(pitch / 2 + half), 0 };
Line(1) = { 1, 2 };
Line(2) = { 2, 3 };
Line(3) = { 3, 4 };
Line(4) = { 4, 1 };
Line(5) = { 2, 5 };
Line(6) = { 5, 6 };
Line(7) = { 6, 3 };
Transfinite Curve{ 1, -3 } = inward + 1;
Transfinite Curve{ 2, 4, 6 } = across + 1;
Transfinite Curve{ 5, -7 } = along + 1;
Curve Loop(1) = { 1, 2, 3, 4 };
Curve Loop(2) = { 5, 6, 7, -2 };
Plane Surface(1) = { 1 };
Plane Surface(2) = { 2 };
Transfinite Surface{ 1, 2 };
Recombine Surface{ 1, 2 };
// The sides come in the order of the lines.
centre() = Extrude { 0, 0, thickness } { Surface{ 1 }; Layers{ layers }; Recombine; };
blade() = Extrude { 0, 0, thickness } { Surface{ 2 }; Layers{ layers }; Recombine; };

Physical Volume("disc") = { centre(1), blade(1) };
Physical Surface("low") = { centre(2) };
Physical Surface("high") = { centre(4) };
Physical Surface("tip") = { blade(3) };

Mesh.ElementOrder = 2;
Mesh.SecondOrderIncomplete = 1;
Mesh.MshFileVersion = 4.1;
