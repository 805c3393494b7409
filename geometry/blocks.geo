// blocks.geo - bodies of hexahedra on a profile of quadrilaterals in the plane (y, z), carried along x
//
// Other scripts include it. A body is begun by Body and made of blocks by Brick; what blocks of one
// body have in common is made once, and what bodies have in common exists in each of them. Side
// finds the face over an edge of the profile, for the named groups.
SetFactory("Built-in");

Macro Body
  // in : py(), pz() points of the profile; turn, its angle about x by the right hand (radians);
  //      x0, x1 the ends; nx elements along x
  // out: P0(), P1() points of the ends; VOL() (filled by Brick)
  P0() = {}; P1() = {}; AX() = {}; EA() = {-1}; EB() = {-1}; C0() = {0}; C1() = {0}; SI() = {0};
  VOL() = {};
  For i In {0:#py()-1}
    yy = py(i)*Cos(turn) - pz(i)*Sin(turn); zz = py(i)*Sin(turn) + pz(i)*Cos(turn);
    p = newp; Point(p) = {x0, yy, zz}; P0() += p;
    p = newp; Point(p) = {x1, yy, zz}; P1() += p;
    c = newc; Line(c) = {P0(i), P1(i)}; AX() += c;
    Transfinite Curve {c} = nx + 1;
  EndFor
Return

Macro Edge
  // in : ea, eb points of the profile; en elements along the edge
  // out: ei, the edge, which is made where it does not exist; es, 1 or -1, its sense
  ei = -1; es = 1;
  For k In {1:#EA()-1}
    If(EA(k) == ea && EB(k) == eb)
      ei = k; es = 1;
    EndIf
    If(EA(k) == eb && EB(k) == ea)
      ei = k; es = -1;
    EndIf
  EndFor
  If(ei < 0)
    ei = #EA(); es = 1;
    EA() += ea; EB() += eb;
    c = newc; Line(c) = {P0(ea), P0(eb)}; C0() += c; Transfinite Curve {c} = en + 1;
    d = newc; Line(d) = {P1(ea), P1(eb)}; C1() += d; Transfinite Curve {d} = en + 1;
    l = newll; Curve Loop(l) = {c, AX(eb), -d, -AX(ea)};
    s = news; Plane Surface(s) = {l}; SI() += s; Transfinite Surface {s}; Recombine Surface {s};
  EndIf
Return

Macro Brick
  // in : q() its four points of the profile, all the way round; n0, n1 elements along the edges
  //      q(0) q(1) and q(1) q(2)
  // out: f0, f1 its faces at the ends, and its volume in VOL()
  bl0() = {}; bl1() = {}; bls() = {};
  For j In {0:3}
    ea = q(j); eb = q((j + 1) % 4); en = n0;
    If(j % 2 == 1)
      en = n1;
    EndIf
    Call Edge;
    bl0() += es*C0(ei); bl1() += es*C1(ei); bls() += SI(ei);
  EndFor
  l = newll; Curve Loop(l) = {bl0()}; f0 = news; Plane Surface(f0) = {l};
  l = newll; Curve Loop(l) = {bl1()}; f1 = news; Plane Surface(f1) = {l};
  Transfinite Surface {f0}; Recombine Surface {f0};
  Transfinite Surface {f1}; Recombine Surface {f1};
  l = newsl; Surface Loop(l) = {f0, f1, bls()};
  v = newv; Volume(v) = {l}; Transfinite Volume {v}; VOL() += v;
Return

Macro Side
  // in : ea, eb points of the profile, the ends of an edge that some block has; out: side, the face over it
  // (to be read on a line of its own: what follows a call on its line is read before)
  en = 1;
  Call Edge;
  side = SI(ei);
Return

Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.SecondOrderIncomplete = 1;    // hexahedra of 20 nodes: none inside faces and elements
Mesh.HighOrderOptimize = 0;        // it would move nodes of the flanks
Mesh.SaveAll = 0;
Mesh.MaxNumThreads1D = 1; Mesh.MaxNumThreads2D = 1; Mesh.MaxNumThreads3D = 1;
