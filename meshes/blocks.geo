// blocks.geo - two unit cubes, one on the other, with nodes of their own on the face they share.
// A mesh of a few kilobytes for tests of the reader and of the pairing. The lower face of the upper
// cube is in two physical groups.
SetFactory("Built-in");
DefineConstant[ n = 3, order = 1 ];

Macro Cube
  // One unit cube from height z0 up; out: SF() faces (bottom, top, four sides), vol
  PT() = {}; LN() = {}; SF() = {};
  For k In {0:1}
    For i In {0:3}
      p = newp; Point(p) = {i == 1 || i == 2, i >= 2, z0 + k}; PT() += p;
    EndFor
  EndFor
  For i In {0:3}
    c = newc; Line(c) = {PT(i), PT((i+1)%4)}; LN() += c;
  EndFor
  For i In {0:3}
    c = newc; Line(c) = {PT(4+i), PT(4+(i+1)%4)}; LN() += c;
  EndFor
  For i In {0:3}
    c = newc; Line(c) = {PT(i), PT(4+i)}; LN() += c;
  EndFor
  For k In {0:1}
    l = newll; Curve Loop(l) = {LN(4*k), LN(4*k+1), LN(4*k+2), LN(4*k+3)};
    s = news; Plane Surface(s) = {l}; SF() += s;
  EndFor
  For i In {0:3}
    l = newll; Curve Loop(l) = {LN(i), LN(8+(i+1)%4), -LN(4+i), -LN(8+i)};
    s = news; Plane Surface(s) = {l}; SF() += s;
  EndFor
  Transfinite Curve {LN()} = n;
  Transfinite Surface {SF()};
  l = newsl; Surface Loop(l) = {SF()}; vol = newv; Volume(vol) = {l};
Return

z0 = 0; Call Cube;
Physical Volume("lower", 2) = {vol};
Physical Surface("base", 22) = {SF(0)};
Physical Surface("lower_top", 21) = {SF(1)};
z0 = 1; Call Cube;
Physical Volume("upper", 1) = {vol};
Physical Surface("upper_bottom", 11) = {SF(0)};
Physical Surface("upper_skin", 12) = {SF()};
Physical Curve("rim", 3) = {LN(4)};
Physical Point("corner", 1) = {PT(6)};
Mesh.ElementOrder = order;
Mesh.SaveAll = 0;
