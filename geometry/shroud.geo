// shroud.geo - a blade in its slot of the disc, with a shroud at its tip that meets those of the neighbours
//
// Units: mm. Axes: x rotation axis, z radial, y tangential. The sector stands half a pitch to the side
// of +y; the other one is its copy, turned by a pitch about x. All bodies are prisms along x. The
// flanks of root and slot lie on each other and have the same mesh, and so have the shrouds, which
// meet in the plane y = 0.
//
// Run:  gmsh -3 shroud.geo -nt 1 -format msh41 -bin -o shroud.msh
// Needs Gmsh 4.8 or later (built-in kernel only).
Include "blocks.geo";

DefineConstant[
  // --- mesh: numbers of elements -------------------------------------------------------------------
  nx     = 3,     // along x
  nflank = 2,     // across a flank of the root
  nair   = 8,     // along the airfoil
  nface  = 1,     // across a shroud's face
  order  = 2,     // element order: 1 or 2
  // --- dimensions ----------------------------------------------------------------------------------
  blades = 60,    // of the whole row: sets the pitch
  Lx     = 30,    // axial length of blade and disc
  Rroot  = 400,   // radius of the bottom of the root
  ta     = 9,     // half width of the root at its bottom
  tn     = 4,     // ... of the neck
  hr     = 3,     // height of the straight part of the root, below the flanks
  hn     = 6,     // height of the neck above the flanks
  hl     = 4,     // height of the disc above the flanks
  hb     = 12,    // thickness of the disc below the root
  depth  = 1,     // of the slot below the root
  flankdeg = 45,  // angle between a flank and the radial direction, degrees
  height = 100,   // of the airfoil, from the neck to the shroud
  th     = 2,     // half thickness of the airfoil at the neck
  tt     = 1.2,   // half thickness of the airfoil at its tip
  hs     = 5      // thickness of the shroud
];
pitch = 2*Pi/blades; fl = flankdeg*Pi/180;
hf = (ta - tn)/Tan(fl);                    // height of a flank
z0 = Rroot; za = z0 + hr; zu = za + hf; zn = zu + hn; zs = zn + height; zt = zs + hs; zj = zu + hl;
ys = zs*Tan(pitch/2); yt = zt*Tan(pitch/2); // half widths of the shroud
yj = (z0 - depth - hb)*Tan(pitch/2);       // half width of the disc at its base
If(tn >= ta || tt >= tn || th > tn || hl > hn || yj <= ta || ys <= tt)
  Error("shroud.geo: the dimensions do not fit together"); Exit;
EndIf
If(order != 1 && order != 2)
  Error("shroud.geo: order = %g: 1 or 2", order); Exit;
EndIf

// ========================================== blade ==============================================
// Rows of points from the bottom of the root up; the airfoil tapers from the neck to the shroud.
py() = {-ta, ta,  -ta, ta,  -tn, tn,  -th, th,  -ys, -tt, tt, ys,  -yt, -tt, tt, yt};
pz() = {z0, z0,  za, za,  zu, zu,  zn, zn,  zs, zs, zs, zs,  zt, zt, zt, zt};
turn = -pitch/2; x0 = -Lx/2; x1 = Lx/2;
Call Body;
q() = {0, 1, 3, 2}; n0 = 2; n1 = 1; Call Brick;
q() = {2, 3, 5, 4}; n1 = nflank; Call Brick;
q() = {4, 5, 7, 6}; n1 = 1; Call Brick;
q() = {6, 7, 10, 9}; n1 = nair; Call Brick;
q() = {8, 9, 13, 12}; n1 = nface; Call Brick;
q() = {9, 10, 14, 13}; Call Brick;
q() = {10, 11, 15, 14}; Call Brick;
Physical Volume("blade", 1) = {VOL()};
ea = 3; eb = 5; Call Side;
Physical Surface("root_right", 11) = {side};
ea = 2; eb = 4; Call Side;
Physical Surface("root_left", 12) = {side};
ea = 8; eb = 12; Call Side;
Physical Surface("shroud_left", 13) = {side};
ea = 11; eb = 15; Call Side;
Physical Surface("shroud_right", 14) = {side};
Physical Point("tip", 1) = {P0(13)};

// =========================================== disc ==============================================
// Rows of points from the base up: the wall of the slot and the border of the sector on either side.
zb = z0 - depth - hb; zd = z0 - depth; t = Tan(pitch/2); wd = ta + depth;
py() = {-zb*t, -wd, wd, zb*t,  -zd*t, -wd, wd, zd*t,  -za*t, -ta, ta, za*t,  -zu*t, -tn, tn, zu*t,  -zj*t, -tn, tn, zj*t};
pz() = {zb, zb, zb, zb,  zd, zd, zd, zd,  za, za, za, za,  zu, zu, zu, zu,  zj, zj, zj, zj};
Call Body;
base() = {};
For b In {0:2}
  q() = {b, b + 1, b + 5, b + 4}; n0 = 2; n1 = 2; Call Brick;
EndFor
For b In {0:2}
  ea = b; eb = b + 1; Call Side;
  base() += side;
EndFor
For row In {1:3}
  For b In {0:2:2}
    c = 4*row + b;
    q() = {c, c + 1, c + 5, c + 4}; n0 = 2; n1 = 1;
    If(row == 2)
      n1 = nflank;
    EndIf
    Call Brick;
  EndFor
EndFor
Physical Volume("disc", 2) = {VOL()};
Physical Surface("base", 21) = {base()};
ea = 10; eb = 14; Call Side;
Physical Surface("slot_right", 22) = {side};
ea = 9; eb = 13; Call Side;
Physical Surface("slot_left", 23) = {side};

Mesh.ElementOrder = order;
