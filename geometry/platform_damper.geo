// platform_damper.geo - a blade on a shank with a platform, and the wedge under the platforms of two
//
// Units: mm. Axes: x rotation axis, z radial through the wedge, y tangential. The blade stands half a
// pitch to the side of +y; the other one is its copy, turned by a pitch about x. Both bodies are
// prisms along x. The flanks of the wedge lie on the platforms' faces, and their meshes do not match.
//
// Run:  gmsh -3 platform_damper.geo -nt 1 -format msh41 -bin -o platform_damper.msh
// Needs Gmsh 4.8 or later (built-in kernel only).
Include "blocks.geo";

DefineConstant[
  // --- mesh: numbers of elements -------------------------------------------------------------------
  nx     = 3,     // of the blade along x
  nshank = 4,     // along the shank
  nair   = 8,     // along the airfoil
  nface  = 1,     // across a platform's face
  nxw    = 5,     // of the wedge along x
  nflank = 2,     // across a flank of the wedge
  order  = 2,     // element order: 1 or 2
  // --- dimensions ----------------------------------------------------------------------------------
  blades = 80,    // of the whole row: sets the pitch
  Lx     = 40,    // axial length of shank, platform and airfoil
  Rplat  = 450,   // radius of the top of the platform
  hp     = 8,     // thickness of the platform
  shank  = 42,    // length of the shank, from the foot to the platform
  ts     = 5,     // half thickness of the shank
  th     = 2,     // half thickness of the airfoil at the hub
  tt     = 1,     // ... and at the tip
  height = 90,    // of the airfoil
  space  = 1,     // between the tops of two platforms
  flankdeg = 45,  // angle between a flank of the wedge and the radial direction, degrees
  Lw     = 36,    // axial length of the wedge
  inset  = 0.15   // what the flank of the wedge leaves free of a platform's face at either edge, a share
];
pitch = 2*Pi/blades; fl = flankdeg*Pi/180;
yt = Rplat*Tan(pitch/2) - space/2;        // half width of the platform at its top
yl = yt - hp*Tan(fl + pitch/2);           // ... and at its underside
If(yl <= ts || th >= ts || Lw > Lx || inset < 0 || inset >= 0.5)
  Error("platform_damper.geo: the dimensions do not fit together"); Exit;
EndIf
If(order != 1 && order != 2)
  Error("platform_damper.geo: order = %g: 1 or 2", order); Exit;
EndIf

// ========================================== blade ==============================================
// Six rows of points, from the foot up; those of the platform are 4 to 15.
zf = Rplat - hp - shank; zu = Rplat - hp; zt = Rplat + height;
py() = {-ts, -th, th, ts,  -yl, -ts, -th, th, ts, yl,  -yt, -ts, -th, th, ts, yt,  -tt, tt};
pz() = {zf, zf, zf, zf,  zu, zu, zu, zu, zu, zu,  Rplat, Rplat, Rplat, Rplat, Rplat, Rplat,  zt, zt};
turn = -pitch/2; x0 = -Lx/2; x1 = Lx/2;
Call Body;
For b In {0:2}
  q() = {b, b + 1, b + 6, b + 5}; n0 = 1; n1 = nshank; Call Brick;
EndFor
For b In {4:8}
  n0 = 1;
  If(b == 4 || b == 8)
    n0 = 2;
  EndIf
  q() = {b, b + 1, b + 7, b + 6}; n1 = nface; Call Brick;
EndFor
q() = {12, 13, 17, 16}; n0 = 1; n1 = nair; Call Brick;
Physical Volume("blade", 1) = {VOL()};
foot() = {};
For b In {0:2}
  ea = b; eb = b + 1; Call Side;
  foot() += side;
EndFor
Physical Surface("foot", 11) = {foot()};
ea = 4; eb = 10; Call Side;
Physical Surface("platform_left", 12) = {side};
ea = 9; eb = 15; Call Side;
Physical Surface("platform_right", 13) = {side};
ea = 12; eb = 16; Call Side;
Physical Surface("airfoil_left", 14) = {side};
Physical Point("tip", 1) = {P0(16)};

// ========================================== wedge ==============================================
// The upper edge of the platform's face beside it, in the frame of the wedge, and the way down along it.
ye = Rplat*Sin(pitch/2) - yt*Cos(pitch/2); ze = Rplat*Cos(pitch/2) + yt*Sin(pitch/2);
face = hp/Cos(fl + pitch/2);
ya = ye + inset*face*Sin(fl);       za = ze - inset*face*Cos(fl);
yb = ye + (1 - inset)*face*Sin(fl); zb = ze - (1 - inset)*face*Cos(fl);
py() = {-yb, yb, ya, -ya}; pz() = {zb, zb, za, za};
turn = 0; x0 = -Lw/2; x1 = Lw/2; nx = nxw;
Call Body;
q() = {0, 1, 2, 3}; n0 = 4; n1 = nflank; Call Brick;
Physical Volume("wedge", 2) = {VOL()};
ea = 3; eb = 0; Call Side;
Physical Surface("wedge_left", 21) = {side};
ea = 1; eb = 2; Call Side;
Physical Surface("wedge_right", 22) = {side};

Mesh.ElementOrder = order;
