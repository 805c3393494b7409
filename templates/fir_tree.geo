// fir_tree.geo: a blade on a fir-tree root with two teeth a side, and the sector of the disc that
// holds it, in millimetres. x is the axis of rotation, z points outwards. Both are prisms along x.
// They share no node: the flanks of each have points, curves and nodes of their own, at the same
// places.
SetFactory("Built-in");
DefineConstant[
  nu = 3,          // nodes across a flank
  nv = 7,          // nodes along a flank
  length = 20,     // of root and disc, along x
  height = 44,     // of the airfoil, a plate
  thickness = 3,   // of the airfoil
  wide = 28,       // half width of the sector of the disc
  deep = 16,       // its depth below the bottom of the root
  lc = 6           // largest element
];

Macro Prism
  // in : half profile y(), z(), counter-clockwise, without points at y = 0; the other half is its
  //      mirror image. flanks(): its segments that touch the other body, the outer one first.
  // out: S() surfaces of the segments, F(), R() points of the front and rear ends, v the volume
  m = #y(); n = 2*m;
  For i In {0:m-1}
    y() += -y(m-1-i); z() += z(m-1-i);
  EndFor
  F() = {}; R() = {}; L() = {}; CF() = {}; CR() = {}; S() = {};
  For i In {0:n-1}
    p = newp; Point(p) = {-length/2, y(i), z(i), lc}; F() += p;
    p = newp; Point(p) = { length/2, y(i), z(i), lc}; R() += p;
    c = newc; Line(c) = {F(i), R(i)}; L() += c;
  EndFor
  For i In {0:n-1}
    j = (i + 1)%n;
    c = newc; Line(c) = {F(i), F(j)}; CF() += c;
    c = newc; Line(c) = {R(i), R(j)}; CR() += c;
  EndFor
  For i In {0:n-1}
    j = (i + 1)%n;
    l = newll; Curve Loop(l) = {CF(i), L(j), -CR(i), -L(i)};
    s = news; Plane Surface(s) = {l}; S() += s;
  EndFor
  l = newll; Curve Loop(l) = {CF()}; front = news; Plane Surface(front) = {l};
  l = newll; Curve Loop(l) = {CR()}; rear = news; Plane Surface(rear) = {l};
  l = newsl; Surface Loop(l) = {S(), front, rear}; v = newv; Volume(v) = {l};
  For k In {0:1}
    i = flanks(k); Call Flank;
    i = n - 2 - flanks(k); Call Flank;
  EndFor
Return

Macro Flank
  // Structured mesh of segment i, from its lower to its upper edge in both bodies alike. The
  // diagonals of the left flanks are the mirror image of those of the right ones.
  a = i; b = i + 1;
  If(z(a) > z(b))
    a = i + 1; b = i;
  EndIf
  Transfinite Curve {CF(i), CR(i)} = nu;
  Transfinite Curve {L(a), L(b)} = nv;
  If(y(i) > 0)
    Transfinite Surface {S(i)} = {F(a), R(a), R(b), F(b)} Right;
  Else
    Transfinite Surface {S(i)} = {F(a), R(a), R(b), F(b)} Left;
  EndIf
Return

// The flanks are at 45 degrees: the lower ones from (5, 3) to (3, 5), the upper ones from (6.5, 9)
// to (4.5, 11).
y() = {3, 5, 5, 3, 3, 6.5, 6.5, 4.5, 4.5, 8, 8, thickness/2, thickness/2};
z() = {0, 2, 3, 5, 6, 8, 9, 11, 14, 14, 16, 16, 16 + height};
flanks() = {6, 2};
Call Prism;
Physical Volume("blade") = {v};
Physical Surface("blade_upper_right") = {S(6)};
Physical Surface("blade_lower_right") = {S(2)};
Physical Surface("blade_upper_left") = {S(n-2-6)};
Physical Surface("blade_lower_left") = {S(n-2-2)};
Physical Point("excitation") = {F(m-1)};   // top of the airfoil, front
Physical Point("tip") = {R(m-1)};          // top of the airfoil, rear

y() = {wide, wide, 5.1, 5.1, 4.5, 6.5, 7.2, 7.2, 3.4, 3, 5, 5.7, 5.7};
z() = {-deep, 13, 13, 11.8, 11, 9, 8.4, 7.7, 5.6, 5, 3, 2.4, -1};
flanks() = {4, 9};
Call Prism;
Physical Volume("disc") = {v};
Physical Surface("disc_upper_right") = {S(4)};
Physical Surface("disc_lower_right") = {S(9)};
Physical Surface("disc_upper_left") = {S(n-2-4)};
Physical Surface("disc_lower_left") = {S(n-2-9)};
Physical Surface("disc_base") = {S(n-1)};
Mesh.ElementOrder = 2; Mesh.MeshSizeMax = lc;
