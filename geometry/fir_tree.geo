// A blade with a fir-tree root of two teeth a side in its disc: two bodies whose flanks face each
// other. Lengths in mm; metres_per_unit = 1e-3. x is the axis of the engine, z the radius.
//
//     gmsh -3 geometry/fir_tree.geo -o fir_tree.msh
//
// -setnumber element_size 3    elements in the bodies, mm
// -setnumber flank_size 1.5    elements on the flanks, mm

SetFactory("OpenCASCADE");
DefineConstant[ element_size = 4.5, flank_size = 2, thickness = 16 ];

// Right half of each outline in the plane of y and z, from the axis upwards.
blade_y() = {3, 6, 6, 4, 4, 7.5, 7.5, 5.5, 5.5, 10, 10, 2, 2};
blade_z() = {0, 2.5, 4, 6, 7, 10.5, 11.5, 13.5, 15.5, 16, 18, 18, 78};
disc_y() = {16, 16, 6.1, 6.1, 7.9, 8.2, 8.2, 4.6, 4.6, 6.4, 6.8, 6.8, 3.5};
disc_z() = {-14, 14.5, 14.5, 12.9, 11.1, 10.8, 10.6, 7.0, 5.4, 3.6, 3.2, 1.8, -1};
last = #blade_y() - 1;

// Extrudes the outline y(), z() with its mirror image; side(i) is the surface of edge i.
Macro Body
  corners() = {};
  For i In {0:last}
    p = newp; Point(p) = {-thickness/2, y(i), z(i), element_size}; corners() += p;
  EndFor
  For i In {0:last}
    p = newp; Point(p) = {-thickness/2, -y(last-i), z(last-i), element_size}; corners() += p;
  EndFor
  edges() = {};
  For i In {0:2*last+1}
    c = newc; Line(c) = {corners(i), corners((i+1) % (2*last+2))}; edges() += c;
  EndFor
  loop = newll; Curve Loop(loop) = {edges()};
  face = news; Plane Surface(face) = {loop};
  made() = Extrude {thickness, 0, 0} { Surface{face}; };
  volume = made(1);
  side() = {};
  For i In {2:#made()-1}
    side() += made(i);
  EndFor
Return

y() = blade_y(); z() = blade_z(); Call Body;
Physical Volume("blade") = {volume};
Physical Surface("blade_lower_right") = {side(2)};
Physical Surface("blade_upper_right") = {side(6)};
Physical Surface("blade_lower_left") = {side(2*last-2)};
Physical Surface("blade_upper_left") = {side(2*last-6)};
fine() = {side(2), side(6), side(2*last-2), side(2*last-6)};

y() = disc_y(); z() = disc_z(); Call Body;
Physical Volume("disc") = {volume};
Physical Surface("disc_upper_right") = {side(3)};
Physical Surface("disc_lower_right") = {side(8)};
Physical Surface("disc_upper_left") = {side(2*last-3)};
Physical Surface("disc_lower_left") = {side(2*last-8)};
Physical Surface("disc_base") = {side(2*last+1)};
Physical Surface("disc_sides") = {side(0), side(2*last)};
fine() += {side(3), side(8), side(2*last-3), side(2*last-8)};

near = 1e-3;
front() = Point In BoundingBox {thickness/2-near, 2-near, 78-near, thickness/2+near, 2+near, 78+near};
Physical Point("tip_front") = {front(0)};
rear() = Point In BoundingBox {-thickness/2-near, 2-near, 78-near, -thickness/2+near, 2+near, 78+near};
Physical Point("tip_rear") = {rear(0)};

MeshSize { PointsOf{ Surface{fine()}; } } = flank_size;
Mesh.ElementOrder = 2;
Mesh.MeshSizeMax = element_size;
