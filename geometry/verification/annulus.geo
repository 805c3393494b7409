// One of n equal sectors of a ring about the x axis, of tetrahedra. The meshes of its faces `low` and `high`
// differ: the high one has `finer` times as many edges on each side.
DefineConstant[ n = 6, edges = 2, finer = 1.5, order = 1 ];

hub = 0.05;    // radius of the bore, m
rim = 0.10;    // outer radius, m
width = 0.03;  // along the axis, m
pitch = 2 * Pi / n;

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
made() = Extrude { { 1, 0, 0 }, { 0, 0, 0 }, pitch } { Surface{ 1 }; };

low() = Boundary { Surface{ 1 }; };
high() = Boundary { Surface{ made(0) }; };
Transfinite Curve{ low() } = edges + 1;
Transfinite Curve{ high() } = Ceil(edges * finer) + 1;
Mesh.MeshSizeMax = (rim - hub) / edges;

Physical Volume("disc") = { made(1) };
Physical Surface("low") = { 1 };
Physical Surface("high") = { made(0) };
Physical Surface("bore") = { made(2) };
Physical Surface("tip") = { made(4) };

Mesh.ElementOrder = order;
Mesh.MshFileVersion = 4.1;
