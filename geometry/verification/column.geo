// A slender column along x and a short block on its end, hexahedra; scenes/verification/column.toml.
//
//     gmsh -3 geometry/verification/column.geo -nt 1 -format msh41 -o meshes/verification/column.msh
//
// Lengths in metres. The faces that touch have the same places and nothing in common.

Geometry.AutoCoherence = 0;

length = 1;      // of the column
height = 0.05;   // of the block
width = 0.04;
along = 32;      // cells along the column
across = 2;

Macro Bar
  // from x = start, of the length size, with cells elements along x
  Point(p + 1) = {start, -width / 2, -width / 2};
  Point(p + 2) = {start, width / 2, -width / 2};
  Point(p + 3) = {start, width / 2, width / 2};
  Point(p + 4) = {start, -width / 2, width / 2};
  For i In {1:4}
    Line(p + i) = {p + i, p + 1 + (i % 4)};
    Transfinite Curve {p + i} = across + 1;
  EndFor
  Curve Loop(p + 1) = {p + 1, p + 2, p + 3, p + 4};
  Plane Surface(p + 1) = {p + 1};
  Transfinite Surface {p + 1};
  Recombine Surface {p + 1};
  made[] = Extrude {size, 0, 0} { Surface{p + 1}; Layers{cells}; Recombine; };
Return

p = 100;
start = 0;
size = length;
cells = along;
Call Bar;
Physical Volume("column") = {made[1]};
Physical Surface("foot") = {p + 1};
Physical Surface("column_end") = {made[0]};

p = 200;
start = length;
size = height;
cells = 1;
Call Bar;
Physical Volume("block") = {made[1]};
Physical Surface("block_end") = {p + 1};
Physical Surface("block_top") = {made[0]};

Mesh.ElementOrder = 1;
