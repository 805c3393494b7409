// lock_plate.geo - the joint of dovetail.geo with a lock plate at either end of its slot
//
// Units and axes are those of dovetail.geo. A plate stands in front of the end planes x = const of root
// and jaw: its lower part lies on the jaw below the slot, its upper part on the root. The plates are of
// hexahedra, the other bodies of tetrahedra, and the meshes do not match where they touch.
//
// Run:  gmsh -3 lock_plate.geo -nt 1 -setnumber nu 4 -setnumber nv 9 -format msh41 -bin -o lock_plate.msh
// Needs Gmsh 4.8 or later (built-in kernel only).
Include "dovetail.geo";
Include "blocks.geo";

DefineConstant[
  nl     = 3,     // elements of a plate across its width, and along its part on the root
  tl     = 3,     // thickness of a plate
  wl     = 4.5,   // half width
  onjaw  = 6,     // height of the part on the jaw
  onroot = 4.5    // ... and of that on the root
];
If(onroot > zu || wl > tu/Cos(sk) || onjaw > hb)
  Error("lock_plate.geo: onroot = %g, wl = %g, onjaw = %g: a plate reaches beyond root or jaw", onroot, wl, onjaw); Exit;
EndIf

Physical Surface("blade_front", 18) = {bFRONT};
Physical Surface("blade_rear", 19) = {bREAR};
Physical Surface("jaw_front", 27) = {jFRONT};
Physical Surface("jaw_rear", 28) = {jREAR};

turn = 0; nx = 1;
For e In {0:1}
  yc = (e - 0.5)*Lx*Tan(sk);       // middle of the slot at this end
  x0 = -Lx/2 - tl; x1 = -Lx/2;
  If(e == 1)
    x0 = Lx/2; x1 = Lx/2 + tl;
  EndIf
  py() = {yc - wl, yc + wl,  yc - wl, yc + wl,  yc - wl, yc + wl,  yc - wl, yc + wl};
  pz() = {z0 - gap - onjaw, z0 - gap - onjaw,  z0 - gap, z0 - gap,  z0, z0,  z0 + onroot, z0 + onroot};
  Call Body;
  INNER() = {};
  For b In {0:2}
    q() = {2*b, 2*b + 1, 2*b + 3, 2*b + 2}; n0 = nl; n1 = nl;
    If(b == 1)
      n1 = 1;
    EndIf
    Call Brick;
    If(e == 0)
      INNER() += f1;
    Else
      INNER() += f0;
    EndIf
  EndFor
  If(e == 0)
    Physical Volume("plate_front", 3) = {VOL()};
    Physical Surface("plate_front_jaw", 31) = {INNER(0)};
    Physical Surface("plate_front_root", 32) = {INNER(2)};
  Else
    Physical Volume("plate_rear", 4) = {VOL()};
    Physical Surface("plate_rear_jaw", 41) = {INNER(0)};
    Physical Surface("plate_rear_root", 42) = {INNER(2)};
  EndIf
EndFor
