// One of n equal sectors of a disc about the x axis whose rim is cut between the sectors: they are one
// piece at the bore (`low`, `high`), have a slit further out, and touch at the rim (`rim_low`, `rim_high`).
DefineConstant[ n = 6, quadratic = 0, layers = 4 ];

hub = 0.05;      // radius of the bore, m
slit = 0.08;     // from here the sectors are apart
flank = 0.10;    // from here they touch
rim = 0.12;      // outer radius, m
width = 0.02;    // along the axis, m

pitch = 2 * Pi / n;
radii[] = { hub, slit, flank, rim };

// The low side: three rectangles in the plane of x and z, turned back by half a pitch.
For i In {0:3}
  Point(1 + 2 * i) = { -width / 2, 0, radii[i] };
  Point(2 + 2 * i) = { width / 2, 0, radii[i] };
  Line(1 + i) = { 1 + 2 * i, 2 + 2 * i };
  Transfinite Curve{ 1 + i } = 3;
EndFor
For i In {0:2}
  Line(11 + i) = { 1 + 2 * i, 3 + 2 * i };
  Line(21 + i) = { 2 + 2 * i, 4 + 2 * i };
  Transfinite Curve{ 11 + i, 21 + i } = 3;
  Curve Loop(1 + i) = { 1 + i, 21 + i, -(2 + i), -(11 + i) };
  Plane Surface(1 + i) = { 1 + i };
  Transfinite Surface{ 1 + i };
  Recombine Surface{ 1 + i };
EndFor
Rotate { { 1, 0, 0 }, { 0, 0, 0 }, -pitch / 2 } { Surface{ 1, 2, 3 }; }

For i In {0:2}
  made() = Extrude { { 1, 0, 0 }, { 0, 0, 0 }, pitch } { Surface{ 1 + i }; Layers{ layers }; Recombine; };
  volumes[i] = made(1);
  ends[i] = made(0);
  // The sides come in the order of the lines of the loop.
  If (i == 0)
    bore = made(2);
  EndIf
  If (i == 2)
    outer = made(4);
  EndIf
EndFor

Physical Volume("disc") = { volumes[] };
Physical Surface("low") = { 1 };
Physical Surface("high") = { ends[0] };
Physical Surface("rim_low") = { 3 };
Physical Surface("rim_high") = { ends[2] };
Physical Surface("bore") = { bore };
Physical Surface("tip") = { outer };

Mesh.ElementOrder = 1 + quadratic;
Mesh.SecondOrderIncomplete = 1;
Mesh.MshFileVersion = 4.1;
