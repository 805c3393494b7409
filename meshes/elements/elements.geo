// Every type of solid element: hexahedra, wedges, and pyramids with tetrahedra, one block beside the other.
DefineConstant[order = 1];
SetFactory("Built-in");
Mesh.ElementOrder = order;
Mesh.SecondOrderIncomplete = 1;

// A square at x = 0, 3, 6 with 2 by 2 (or 1 by 1) divisions.
For block In {0:2}
  x = 3 * block;
  n = block == 1 ? 2 : 3;
  p = 10 * block;
  Point(p + 1) = {x, 0, 0};
  Point(p + 2) = {x + 2, 0, 0};
  Point(p + 3) = {x + 2, 1, 0};
  Point(p + 4) = {x, 1, 0};
  Line(p + 1) = {p + 1, p + 2};
  Line(p + 2) = {p + 2, p + 3};
  Line(p + 3) = {p + 3, p + 4};
  Line(p + 4) = {p + 4, p + 1};
  Curve Loop(p + 1) = {p + 1, p + 2, p + 3, p + 4};
  Plane Surface(p + 1) = {p + 1};
  Transfinite Curve {p + 1, p + 2, p + 3, p + 4} = n;
  Transfinite Surface {p + 1};
EndFor
Recombine Surface {1};

hexahedra[] = Extrude {0, 0, 1.5} { Surface{1}; Layers{2}; Recombine; };
wedges[] = Extrude {0, 0, 1.5} { Surface{11}; Layers{2}; Recombine; };
mixed[] = Extrude {0, 0, 1.5} { Surface{21}; Layers{2}; QuadTriAddVerts; Recombine; };

Physical Volume("hexahedra") = {hexahedra[1]};
Physical Volume("wedges") = {wedges[1]};
Physical Volume("mixed") = {mixed[1]};
Physical Surface("base") = {1, 11, 21};
Physical Surface("top") = {hexahedra[0], wedges[0], mixed[0]};
Physical Surface("side") = {hexahedra[2], wedges[2], mixed[2]};
Physical Curve("edge") = {1, 11, 21};
