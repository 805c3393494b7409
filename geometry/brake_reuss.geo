// brake_reuss.geo - one half of the Brake-Reuss beam: a bar whose end is cut to half its height, with
// three bolt holes in the lap
//
// Units: mm. The beam lies along x, its bolts along z, the lap joint is x = -60 .. 60 in the plane z = 0.
// This half reaches from x = -360 to 60 and has its lap below z = 0; the other one is its copy, turned
// by 180 degrees about y. The mesh is the same to either side of x = 0, so that the laps match.
//
// Run:  gmsh -3 brake_reuss.geo -nt 1 -format msh41 -bin -o brake_reuss.msh
// Needs Gmsh 4.8 or later (built-in kernel only).
SetFactory("Built-in");

DefineConstant[
  // --- mesh: numbers of elements -------------------------------------------------------------------
  narc   = 3,     // along a quarter of a hole
  nrad   = 2,     // from a washer to the edges around it
  nend   = 3,     // along the lap beyond the outer bolts
  nz     = 2,     // over the height of the lap, half of that of the beam
  nbar   = 12,    // along the bar
  order  = 2,     // element order: 1 or 2
  // --- dimensions ----------------------------------------------------------------------------------
  length = 300,   // of the bar, from its free end to the lap
  lap    = 120,   // length of the lap
  side   = 25.4,  // of the square section
  pitch  = 30,    // between two bolts
  hole   = 8.5,   // diameter
  washer = 17.46  // diameter
];
If(order != 1 && order != 2)
  Error("brake_reuss.geo: order = %g: 1 or 2", order); Exit;
EndIf
If(hole >= washer || washer >= side || washer >= pitch || 3*pitch >= lap)
  Error("brake_reuss.geo: the dimensions do not fit together"); Exit;
EndIf
h = side/2;

Macro Quad
  // in : c() four curves with their sense, all the way round; ends at new surface s, structured
  l = newll; Curve Loop(l) = {c()};
  s = news; Plane Surface(s) = {l};
  Transfinite Surface {s}; Recombine Surface {s};
Return

// The plane z = -h. Five lines x = const across the lap, and that at the end of the bar.
xs() = {-length - lap/2, -lap/2, -1.5*pitch, -0.5*pitch, 0.5*pitch, 1.5*pitch, lap/2};
nn() = {nbar, nend, narc, narc, narc, nend};
LOW() = {}; HIGH() = {}; ACR() = {}; BOT() = {}; TOP() = {};
For i In {0:6}
  p = newp; Point(p) = {xs(i), -h, -h}; LOW() += p;
  p = newp; Point(p) = {xs(i), h, -h}; HIGH() += p;
  c = newc; Line(c) = {LOW(i), HIGH(i)}; ACR() += c; Transfinite Curve {c} = narc + 1;
EndFor
For i In {0:5}
  c = newc; Line(c) = {LOW(i), LOW(i+1)}; BOT() += c; Transfinite Curve {c} = nn(i) + 1;
  c = newc; Line(c) = {HIGH(i), HIGH(i+1)}; TOP() += c; Transfinite Curve {c} = nn(i) + 1;
EndFor
PLAIN() = {}; RING() = {};
c() = {BOT(0), ACR(1), -TOP(0), -ACR(0)};
Call Quad;
bar = s;
For i In {1:5:4}
  c() = {BOT(i), ACR(i+1), -TOP(i), -ACR(i)};
  Call Quad;
  PLAIN() += s;
EndFor
// Around each bolt: the washer's ring and what is between it and the edges, in four parts.
For i In {2:4}
  xc = 0.5*(xs(i) + xs(i+1));
  m = newp; Point(m) = {xc, 0, -h};
  // From the lower left corner, counter-clockwise.
  OUT() = {LOW(i), LOW(i+1), HIGH(i+1), HIGH(i)}; EDGE() = {BOT(i), ACR(i+1), -TOP(i), -ACR(i)};
  PH() = {}; PW() = {}; SP() = {}; SW() = {}; AH() = {}; AW() = {};
  For j In {0:3}
    a = (2*j + 5)*Pi/4;
    p = newp; Point(p) = {xc + hole/2*Cos(a), hole/2*Sin(a), -h}; PH() += p;
    p = newp; Point(p) = {xc + washer/2*Cos(a), washer/2*Sin(a), -h}; PW() += p;
    c = newc; Line(c) = {PH(j), PW(j)}; SP() += c; Transfinite Curve {c} = 2;
    c = newc; Line(c) = {PW(j), OUT(j)}; SW() += c; Transfinite Curve {c} = nrad + 1;
  EndFor
  For j In {0:3}
    k = (j + 1) % 4;
    c = newc; Circle(c) = {PH(j), m, PH(k)}; AH() += c; Transfinite Curve {c} = narc + 1;
    c = newc; Circle(c) = {PW(j), m, PW(k)}; AW() += c; Transfinite Curve {c} = narc + 1;
  EndFor
  For j In {0:3}
    k = (j + 1) % 4;
    c() = {AH(j), SP(k), -AW(j), -SP(j)};
    Call Quad;
    RING() += s;
    c() = {AW(j), SW(k), -EDGE(j), -SW(j)};
    Call Quad;
    PLAIN() += s;
  EndFor
EndFor

// Up to the plane of the lap, and the bar on to the full height.
VOL() = {}; CONTACT() = {};
FACES() = {PLAIN(), RING()};
For i In {0:#FACES()-1}
  e() = Extrude {0, 0, h} { Surface{FACES(i)}; Layers{nz}; Recombine; };
  CONTACT() += e(0); VOL() += e(1);
EndFor
e() = Extrude {0, 0, h} { Surface{bar}; Layers{nz}; Recombine; };
VOL() += e(1);
END() = {e(5)};
g() = Extrude {0, 0, h} { Surface{e(0)}; Layers{nz}; Recombine; };
VOL() += g(1);
END() += g(5);

Physical Volume("half", 1) = {VOL()};
Physical Surface("lap", 11) = {CONTACT()};
Physical Surface("washers", 12) = {RING()};
Physical Surface("end", 13) = {END()};
Physical Surface("underside", 14) = {bar};
Physical Point("corners", 1) = {LOW(0), HIGH(0)};

Mesh.ElementOrder = order;
Mesh.SecondOrderIncomplete = 1;    // hexahedra of 20 nodes: none inside faces and elements
// The middle of an edge of a flank follows its two ends: off the straight line between them it would
// resist a turn of the whole body.
Mesh.SecondOrderLinear = 1;
Mesh.HighOrderOptimize = 0;        // it would move nodes of the flanks
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.SaveAll = 0;
Mesh.MaxNumThreads1D = 1; Mesh.MaxNumThreads2D = 1; Mesh.MaxNumThreads3D = 1;
