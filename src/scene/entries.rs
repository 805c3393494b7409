//! Keys of a scene file. Each entry has the meaning of the key, its unit, its default, its valid
//! values and an example line. Messages take their examples from here, and docs/scene.md its
//! tables.

use serde_spanned::Spanned;

use super::keys::{SceneSection, Vocabulary, section};
use super::kinds::Limits;
use super::raw::Located;
use dovetail_mesh::units::Units;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution, Solver, StabilityScope};
use dovetail_solver::dlft::static_state::LoadPath;
use dovetail_solver::dlft::sweep::SweepSettings;
use dovetail_solver::model::{ContactLaw, Gap, Prestress, Sector, Side};
use dovetail_solver::reduced::ObservedQuantity;
use strum::VariantNames;

/// Upper limit of the tolerance of the relative residual of a balance: a solution with a larger
/// residual does not count as a motion.
pub const LARGEST_TOLERANCE: f64 = 1e-3;

/// [`Resolution::MOST_HARMONICS`] as the limit of a key.
const MOST_HARMONICS: u32 = Resolution::MOST_HARMONICS as u32;

/// Keys of a scene.
pub const SCENE: Vocabulary = Vocabulary {
    former: &[
        ("excitation", "points", "on"),
        ("damping", "stuck_mode", "linear_mode"),
        (
            "response",
            "times_first_stuck_mode",
            "times_first_linear_mode",
        ),
        (
            "mesh",
            "pairing_tolerance",
            "search_distance_m of [[contact]]",
        ),
    ],
    sections: &SECTIONS,
};

/// [`Vocabulary::example`] of a scene.
pub fn example(section: &str, key: &str) -> &'static str {
    SCENE.example(section, key)
}

/// Words of [`Units::SYSTEMS`].
pub const UNITS: [&str; 3] = [
    Units::SYSTEMS[0].0,
    Units::SYSTEMS[1].0,
    Units::SYSTEMS[2].0,
];

/// Sections: the top of the file, then the tables in the order in which they are usually written.
const SECTIONS: [SceneSection; 18] = [
    TOP,
    REDUCED_MODEL,
    MESH,
    BODY,
    ROTATION,
    CYCLIC,
    CONTACT,
    SPRING,
    DASHPOT,
    LOAD,
    DAMPING,
    EXCITATION,
    OBSERVE,
    STATIC,
    STATIC_PATH,
    RESPONSE,
    ENGINE_ORDER,
    MISSION,
];

section! {
    TOP: RawScene, "", Table, "", "", "" {
        name: Name, "-",
            "a name; results go to `output/<name>`",
            "\"paper\"";
    } and {
        pub reduced_model: Located<RawReducedModel>,
        pub mesh: Located<RawMesh>,
        #[serde(default)]
        pub body: Vec<Spanned<RawBody>>,
        pub rotation: Located<RawRotation>,
        pub cyclic: Located<RawCyclic>,
        #[serde(default)]
        pub contact: Vec<Spanned<RawContact>>,
        #[serde(default)]
        pub spring: Vec<Spanned<RawSpring>>,
        #[serde(default)]
        pub dashpot: Vec<Spanned<RawDashpot>>,
        #[serde(default)]
        pub load: Vec<Spanned<RawLoad>>,
        pub damping: Located<RawDamping>,
        #[serde(default)]
        pub excitation: Vec<Spanned<RawExcitation>>,
        #[serde(default)]
        pub observe: Vec<Spanned<RawObserve>>,
        #[serde(rename = "static")]
        pub static_state: Located<RawStatic>,
        pub response: Located<RawResponse>,
        #[serde(default)]
        pub engine_order: Vec<Spanned<RawEngineOrder>>,
        #[serde(default)]
        pub mission: Vec<Spanned<RawMission>>,
    }
}

section! {
    REDUCED_MODEL: RawReducedModel, "reduced_model", Table, "in place of a mesh",
        "a reduced model, read from a folder",
        "[reduced_model]\nfolder = \"den_hartog\"\nfriction = 0.3\nforce_n = 1.0" {
        folder: Text("path of a folder"), "-",
            "holds [the files](how-to/reduced_model.md#the-folder) that `dovetail reduce` writes",
            "\"den_hartog\"  # model.json and the matrices";
        friction: Number("", Limits::NOT_NEGATIVE), "-",
            "Coulomb coefficient of every pair; above 1000 computed as 1000, with a warning",
            "0.3";
        normal_stiffness_n_m: Number("N/m", Limits::POSITIVE), "none: the contact is rigid",
            "spring of every pair against penetration, with `tangential_stiffness_n_m`",
            "1e9";
        tangential_stiffness_n_m: Number("N/m", Limits::POSITIVE), "none: the contact is rigid",
            "spring of every pair against shear, with `normal_stiffness_n_m`",
            "1e9";
        gap_m: Number("m", Limits::NOT_NEGATIVE), "0",
            "initial clearance of every pair",
            "0.0";
        wear_m2_n: Number("m2/N", Limits::NOT_NEGATIVE), "0",
            "coefficient of wear of every pair, for [`dovetail wear`](how-to/wear.md)",
            "1e-14";
        force_n: Number("N", Limits::NOT_NEGATIVE), "-",
            "amplitude of the excitation in all",
            "1.0";
    }
}

section! {
    MESH: RawMesh, "mesh", Table, "one, or `mesh_file` of each body, or `[reduced_model]`",
        "the mesh that bodies share, or the script that gmsh makes it from",
        "[mesh]\nfile = \"../meshes/dovetail.msh\"\nmetres_per_unit = 1e-3" {
        geometry: Text("path of a Gmsh script"), "- or `file`",
            "meshed by the program `gmsh` in the run; the script is code that runs",
            "\"../geometry/dovetail.geo\"";
        parameters: NumberTable, "`{}`",
            "parameters that the script defines ([those of dovetail.geo](geometry.md)), and \
             options of gmsh; one without effect is an error, see below",
            "{ nu = 4, nv = 9, order = 2 }";
        time_limit_s: Number("s", Limits::open_interval(0.0, 1e9)), "120",
            "gmsh is stopped after it",
            "120";
        fallback: Text("path of a `.msh`"), "none",
            "used where gmsh is missing and `parameters` equal `fallback_parameters`",
            "\"../meshes/dovetail.msh\"";
        fallback_parameters: NumberTable, "none",
            "what `fallback` was made with; required with it, meaningless without",
            "{ nu = 4, nv = 9, order = 2 }";
        file: Text("path of a mesh"), "- or `geometry`",
            "of a [format that is read](how-to/own_mesh.md): MSH, a deck of Abaqus or CalculiX, \
             an archive of Ansys, bulk data of Nastran, VTU",
            "\"../meshes/dovetail.msh\"";
        metres_per_unit: Number("m", Limits::POSITIVE), "- or `units`",
            "1e-3 for a mesh in millimetres",
            "1e-3  # the mesh is in millimetres";
        units: Choice(&UNITS), "- or `metres_per_unit`",
            "`\"m-kg-s\"`: metre, kilogram, second (Pa, kg/m3); `\"mm-t-s\"`: millimetre, tonne, \
             second (MPa, t/mm3); `\"in-lbf-s\"`: inch, pound-force, second (psi, lbf s2/in4). What \
             the lengths of the mesh are in, and the materials of its file",
            "\"mm-t-s\"";
    }
}

section! {
    BODY: RawBody, "body", List, "one or more",
        "a body, and how it is held",
        "[[body]]\nname = \"blade\"\nvolume = \"blade\"\nyoung_pa = 113.8e9" {
        name: Name, "-",
            "a name, each different",
            "\"blade\"";
        mesh_file: Text("path of a mesh"), "that of `[mesh]`",
            "a mesh of the body's own; its groups are `<body>.<group>` for all other tables, or \
             `<group>` where no other body has one of that name",
            "\"blade.inp\"";
        metres_per_unit: Number("m", Limits::POSITIVE), "that of `[mesh]`",
            "of `mesh_file`",
            "1e-3  # the mesh is in millimetres";
        units: Choice(&UNITS), "those of `[mesh]`",
            "`\"m-kg-s\"`, `\"mm-t-s\"` or `\"in-lbf-s\"`, of `mesh_file`, as in `[mesh]`",
            "\"mm-t-s\"";
        copy_of: Text("name of a body"), "none",
            "takes the mesh of a body above, in its place, and all keys of that body that are not \
             given here",
            "\"blade\"";
        rotation_deg: Number("degrees", Limits::ANY), "0",
            "turns the mesh of `mesh_file` or `copy_of` about `rotation_axis`, by the right hand",
            "12.5";
        rotation_axis: Numbers(3, ""), "- where it is turned",
            "direction of the axis of any length",
            "[1, 0, 0]";
        rotation_point_m: Numbers(3, "m"), "`[0, 0, 0]`",
            "a point of the axis",
            "[0, 0, 0]";
        translation_m: Numbers(3, "m"), "`[0, 0, 0]`",
            "moves the mesh of `mesh_file` or `copy_of`, once it is turned",
            "[0, 0, 0.45]";
        volume: Text("group"), "- or that of `copy_of`",
            "volume group; each body of a mesh has its own",
            "\"blade\"  # a physical volume of the mesh";
        material: Text("name of a material"), "the one that the mesh gives to the volume",
            "a material of the mesh file, in place of `young_pa`, `poisson` and `density_kg_m3`; it needs \
             `units`",
            "\"TITANIUM\"";
        young_pa: Number("Pa", Limits::POSITIVE), "- or `material`, or `stiffness_file`",
            "Young's modulus",
            "113.8e9";
        poisson: Number("", Limits::open_interval(-1.0, 0.5)), "- or `material`, or `stiffness_file`",
            "Poisson's ratio",
            "0.34";
        density_kg_m3: Number("kg/m3", Limits::POSITIVE),
            "- or `mass_kg`, or `material`, or `stiffness_file`",
            "density",
            "4430";
        mass_kg: Number("kg", Limits::POSITIVE), "- or `density_kg_m3`",
            "mass of the body, instead of `density_kg_m3`: the density is the mass over the volume \
             of the elements",
            "0.35";
        endurance_pa: Number("Pa", Limits::POSITIVE), "none: stress is not judged",
            "amplitude of stress about no mean that the material endures, with `ultimate_pa`: the \
             [places of the highest stress](how-to/stress.md) are ranked by it",
            "450e6";
        ultimate_pa: Number("Pa", Limits::POSITIVE), "none: stress is not judged",
            "stress at which the material breaks, with `endurance_pa`",
            "950e6";
        stiffness_file: Text("path of a matrix"), "none: finite elements",
            "the stiffness of the body from another program, in place of finite elements and a \
             material, with `mass_file`: a [format that is read](how-to/matrices.md)",
            "\"blade.sti\"  # and mass_file = \"blade.mas\"";
        mass_file: Text("path of a matrix"), "- with `stiffness_file`",
            "the mass that belongs to it, in the same units, those of the mesh (`units`)",
            "\"blade.mas\"";
        rows_file: Text("path of a table"), "the rows that `stiffness_file` names",
            "the node and direction of each row of both matrices",
            "\"blade.dof\"";
        load_file: Text("path of a matrix"), "none",
            "steady forces on the rows, a matrix of one column, in newtons: what the other program \
             makes of a rotation, a temperature or a pressure",
            "\"blade_load.mtx\"";
        stiffness_name: Text("name of a matrix"), "the only one, or one of a customary name",
            "the matrix of `stiffness_file`, where that has several",
            "\"KAA\"";
        mass_name: Text("name of a matrix"), "the only one, or one of a customary name",
            "the matrix of `mass_file`, where that has several",
            "\"MAA\"";
        load_name: Text("name of a matrix"), "the only one of one column",
            "the matrix of `load_file`, where that has several",
            "\"PA\"";
        fixed: Texts("list of groups"), "`[]`",
            "groups of any dimension; their nodes do not move",
            "[\"jaw_base\"]";
        fixed_x: Texts("list of groups"), "`[]`",
            "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
             along the flank, and on both sides of the contact alike",
            "[\"plane_x\"]  # a plane of symmetry";
        fixed_y: Texts("list of groups"), "`[]`",
            "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
             along the flank, and on both sides of the contact alike",
            "[\"plane_y\"]  # a plane of symmetry";
        fixed_z: Texts("list of groups"), "`[]`",
            "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
             along the flank, and on both sides of the contact alike",
            "[\"plane_z\"]  # a plane of symmetry";
        fixed_interface_modes: Whole(Some(0), Some(10_000)), "none",
            "the body is first reduced by itself to its contact nodes and so many modes \
             (Craig-Bampton, [method.md](method.md)); without the key it is not",
            "6";
    }
}

section! {
    ROTATION: RawRotation, "rotation", Table, "optional",
        "the speed about an axis",
        "[rotation]\naxis = [1, 0, 0]\nspeed_rpm = 5000" {
        axis: Numbers(3, ""), "-",
            "not all 0; any length",
            "[1, 0, 0]";
        point_m: Numbers(3, "m"), "`[0, 0, 0]`",
            "a point of the axis. Metres, not mesh units",
            "[0, 0, 0]";
        speed_rpm: Number("rpm", Limits::non_negative_below(1e7)), "-",
            "speed of rotation",
            "5000";
        bodies: Texts("list of body names"), "all bodies",
            "the bodies that turn: they have the centrifugal load and the spin softening, and with \
             `\"held_flanks\"` they alone are stiffened",
            "[\"blade\", \"jaw\"]";
        prestress: Choice(Prestress::VARIANTS), "`\"contact\"`",
            "`\"contact\"`: geometric stiffness of the static state with contact and friction, in \
             all bodies, repeated until the normal forces stay, and spin softening; \
             `\"held_flanks\"`: that of each body with its contact nodes held, which lacks the \
             stress that a contact hands on; `\"none\"`: the load only",
            "\"contact\"";
    }
}

section! {
    CYCLIC: RawCyclic, "cyclic", Table, "optional",
        "the disc of which the bodies are one of several equal sectors",
        "[cyclic]\nsectors = 36\nlow = [\"sector_low\"]\nhigh = [\"sector_high\"]" {
        sectors: Whole(Some(2), Some(10_000)), "-",
            "number of sectors of the whole disc",
            "36";
        low: Texts("list of surface groups"), "-",
            "faces at which the sector before ends",
            "[\"sector_low\"]";
        high: Texts("list of surface groups"), "-",
            "faces at which the next sector begins: those of `low` come here when they are turned by \
             one pitch about the axis, by the right hand. The meshes of the two need not match",
            "[\"sector_high\"]";
        axis: Numbers(3, ""), "that of `[rotation]`",
            "axis of the disc, of any length",
            "[1, 0, 0]";
        point_m: Numbers(3, "m"), "that of `[rotation]`, or `[0, 0, 0]`",
            "a point of the axis",
            "[0, 0, 0]";
        engine_order: Whole(Some(0), Some(100_000)), "0: all sectors are excited in phase",
            "waves of the excitation round the disc, which stand still in space: harmonic k of the \
             excitation of sector j, counted from 0 in the direction of the right hand, is that of \
             the first one, turned by `360 k engine_order j / sectors` degrees in time",
            "5";
        influence: Text("path of a CSV file"), "none: the air does not act back",
            "[aerodynamic influence](how-to/disc.md#the-air-between-the-blades): columns \
             `nodal_diameter`, `mode`, `by_mode`, `real_n_m`, `imaginary_n_m`",
            "\"air.csv\"";
        influence_on: Text("body"), "the only body",
            "body whose modes with its flanks held the numbers of `influence` are",
            "\"blade\"";
    }
}

section! {
    CONTACT: RawContact, "contact", List, "none or more",
        "two flanks that touch, and the law between them",
        "[[contact]]\nname = \"left\"\nfirst = \"blade_flank_left\"\n\
                  second = \"jaw_flank_left\"\nfriction = 0.3" {
        name: Name, "-",
            "a name, each different",
            "\"left\"";
        first: Text("group"), "-",
            "surface group of a body",
            "\"blade_flank_left\"  # a physical surface of the blade";
        second: Text("group"), "rigid ground",
            "surface group that lies opposite `first`, of another body or of the same one; the \
             meshes of the two need not match",
            "\"jaw_flank_left\"  # a physical surface of the jaw";
        second_sector: Choice(Sector::VARIANTS), "`\"same\"`",
            "of a [disc of equal sectors](how-to/disc.md): `\"next\"` if `second` is the surface of the \
             next sector, as of two shrouds, and `\"same\"` otherwise",
            "\"next\"";
        slave: Choice(Side::VARIANTS),
            "the side of the smaller facets; `\"first\"` where they are alike",
            "the slave side, `\"first\"` or `\"second\"`: contact is enforced at its nodes, \
             against the facets of the other side",
            "\"second\"";
        law: Choice(ContactLaw::VARIANTS), "`\"unilateral_coulomb\"`",
            "`\"unilateral_coulomb\"`: compression only, dry friction; `\"bonded\"`: both sides \
             move as one, and `friction` (then not required), the stiffnesses, `gap_m`, \
             `wear_m2_n` and the crown are not used",
            "\"bonded\"";
        friction: Number("", Limits::NOT_NEGATIVE), "- or `friction_file` (`\"bonded\"`: none)",
            "Coulomb coefficient, 0 for a frictionless contact; above 1000 computed as 1000, with \
             a warning",
            "0.3";
        friction_file: Text("path of a CSV file"), "none",
            "coefficients at points in space in place of `friction`: each pair has that of the \
             [nearest point](how-to/several_bodies.md#friction-that-varies-over-a-flank)",
            "\"friction.csv\"  # columns x_m, y_m, z_m, friction";
        normal_stiffness_n_m3: Number("N/m3", Limits::POSITIVE), "none: the contact is rigid",
            "springs per area against penetration (penalty contact), with \
             `tangential_stiffness_n_m3`: a pressure p presses the sides p / \
             `normal_stiffness_n_m3` into each other",
            "1e14";
        tangential_stiffness_n_m3: Number("N/m3", Limits::POSITIVE), "none: the contact is rigid",
            "springs per area against shear, which stretch before the sides slide, with \
             `normal_stiffness_n_m3`",
            "1e14";
        gap: Choice(Gap::VARIANTS), "`\"closed\"`",
            "`\"closed\"`: the sides touch, however far apart the mesh has them; `\"mesh\"`: their \
             distance in the mesh is clearance (on curved sides that do not match it alternates \
             from node to node)",
            "\"mesh\"";
        gap_m: Number("m", Limits::ANY), "0",
            "initial clearance, added to that of `gap`; negative where the sides interfere (a \
             press fit), which is applied with the steady load",
            "0.0";
        wear_m2_n: Number("m2/N", Limits::NOT_NEGATIVE), "0",
            "coefficient of wear of both sides together, for [`dovetail wear`](how-to/wear.md): \
             worn volume per normal force and distance slid",
            "1e-14";
        search_distance_m: Number("m", Limits::POSITIVE), "half of the longest edge of both facets",
            "facets farther apart than this along their normals are not opposite each other",
            "0.5e-3";
        crown_radius_m: Number("m", Limits::POSITIVE), "none",
            "adds the clearance d^2 / (2 `crown_radius_m`)",
            "2.0";
        crown_axis: Numbers(3, ""), "none",
            "along the flank, any length; only with `crown_radius_m`",
            "[1, 0, 0]  # a cylinder along x";
        crown_centre_m: Numbers(3, "m"), "centroid of the flank",
            "only with `crown_radius_m`",
            "[0, 0, 0.45]";
    }
}

section! {
    SPRING: RawSpring, "spring", List, "none or more",
        "a linear spring to ground or between two groups",
        "[[spring]]\nname = \"foot\"\nfirst = \"base\"\nstiffness_n_m = 1e6" {
        name: Name, "-",
            "a name, each different",
            "\"foot\"";
        first: Text("group"), "-",
            "part of the surface of one body, or a group of its nodes",
            "\"base\"  # a physical surface or point of the mesh";
        second: Text("group"), "ground",
            "the same, of another body or of the same one: the spring joins the mean displacements \
             of the two; left out, it is a foundation under all of `first`, on ground that moves \
             with the base",
            "\"frame\"";
        stiffness_n_m: Number("N/m", Limits::POSITIVE), "-",
            "in all, not per area or node: to ground it is shared by the area of a surface, or \
             equally by the nodes of a group",
            "1e6";
        direction: Numbers(3, ""), "all three axes",
            "the spring acts along it alone; not all 0, any length",
            "[0, 0, 1]";
    }
}

section! {
    DASHPOT: RawDashpot, "dashpot", List, "none or more",
        "a viscous damper to ground or between two groups",
        "[[dashpot]]\nname = \"mount\"\nfirst = \"base\"\ndamping_n_s_m = 50" {
        name: Name, "-",
            "a name, each different",
            "\"mount\"";
        first: Text("group"), "-",
            "part of the surface of one body, or a group of its nodes",
            "\"base\"  # a physical surface or point of the mesh";
        second: Text("group"), "ground",
            "the same, of another body or of the same one; ground moves with the base",
            "\"frame\"";
        damping_n_s_m: Number("N s/m", Limits::POSITIVE), "-",
            "in all, not per area or node: the force over the difference of the mean velocities \
             of the two groups. It resists no motion that leaves the mean of a group at rest",
            "50.0";
        direction: Numbers(3, ""), "all three axes",
            "the dashpot acts along it alone; not all 0, any length",
            "[0, 0, 1]";
    }
}

section! {
    LOAD: RawLoad, "load", List, "none or more",
        "a steady force, traction or pressure",
        "[[load]]\non = \"top\"\npressure_pa = 1e6" {
        on: Text("group"), "-",
            "points or a curve (a force is shared equally by the nodes), or part of the surface of \
             one body (spread uniformly over its area)",
            "\"top\"  # a physical surface or point of the mesh";
        force_n: Number("N", Limits::NOT_NEGATIVE), "- or `traction_pa`, `pressure_pa`",
            "the whole force",
            "100.0";
        traction_pa: Number("Pa", Limits::NOT_NEGATIVE), "- or `force_n`, `pressure_pa`",
            "force over area along `direction`; surfaces only",
            "1e5";
        direction: Numbers(3, ""), "- or `pressure_pa`",
            "of a force or traction, not all 0; any length",
            "[0, 0, -1]";
        pressure_pa: Number("Pa", Limits::ANY), "- or `force_n`, `traction_pa`",
            "acts along the inward normal; surfaces only",
            "1e6";
    }
}

section! {
    DAMPING: RawDamping, "damping", Table, "required",
        "viscous damping of the material",
        "[damping]\nratio = 0.001" {
        ratio: Number("", Limits::non_negative_below(1.0)),
            "- or `stiffness_s`, `mass_per_s`, `modal_ratios`",
            "share of critical damping on linear mode `linear_mode`, by stiffness-proportional \
             damping",
            "0.001";
        linear_mode: Whole(Some(1), Some(10_000)), "1",
            "no more than `response.stuck_modes` where that is given; only with `ratio`",
            "1";
        stiffness_s: Number("s", Limits::NOT_NEGATIVE), "0",
            "C = `stiffness_s` K + `mass_per_s` M",
            "1e-6";
        mass_per_s: Number("1/s", Limits::NOT_NEGATIVE), "0",
            "see `stiffness_s`",
            "0.1";
        modal_ratios: NumberList("", Limits::non_negative_below(1.0)), "none",
            "shares of critical damping of the first modes with all pairs stuck, in place of what \
             the other keys give these modes; further modes have the damping of the other keys, \
             and none without them",
            "[0.001, 0.002]";
    }
}

section! {
    EXCITATION: RawExcitation, "excitation", List, "one or more",
        "what shakes: a force, traction or pressure, a field of them, or the base",
        "[[excitation]]\non = \"excitation\"\ndirection = [0, 1, 0]\nforce_n = 2.0" {
        on: Text("group"), "- or a base",
            "as `load.on`",
            "\"excitation\"  # a physical point or surface of the mesh";
        force_n: Number("N", Limits::NOT_NEGATIVE), "- or another cause",
            "amplitude of the whole force",
            "2.0";
        traction_pa: Number("Pa", Limits::NOT_NEGATIVE), "- or another cause",
            "amplitude of the force over area along `direction`; surfaces only",
            "500.0";
        direction: Numbers(3, ""), "- or `pressure_pa`, `file`",
            "of a force, a traction or the base, not all 0; any length",
            "[0, 1, 0]";
        pressure_pa: Number("Pa", Limits::ANY), "- or another cause",
            "amplitude along the inward normal; surfaces only",
            "200.0";
        file: Text("path of a CSV file"), "- or another cause",
            "complex pressures or forces at points in space, [mapped to the \
             surface](how-to/surface_excitation.md#pressures-of-a-flow)",
            "\"pressure.csv\"";
        factor: Number("", Limits::NOT_NEGATIVE), "1",
            "multiplies the values of `file`",
            "1.0";
        base_acceleration_m_s2: Number("m/s2", Limits::NOT_NEGATIVE), "- or another cause",
            "amplitude along `direction` of all supports, of rigid ground and of the ground of \
             springs, which move as one; displacements are then [relative to \
             them](how-to/surface_excitation.md#a-base-that-shakes)",
            "9.81";
        base_displacement_m: Number("m", Limits::NOT_NEGATIVE), "- or another cause",
            "the same, given by the amplitude of the displacement",
            "1e-5";
        harmonic: Whole(Some(1), Some(MOST_HARMONICS)), "1",
            "at most `response.harmonics`",
            "1";
        phase_deg: Number("degrees", Limits::ANY), "0",
            "by which the cause lags behind cos(w t)",
            "0.0";
    }
}

section! {
    OBSERVE: RawObserve, "observe", List, "one or more",
        "a displacement or a strain that is followed",
        "[[observe]]\nname = \"tip\"\npoints = \"tip_trailing_edge\"\n\
                  direction = [0, 1, 0]" {
        name: Name, "-",
            "a name, each different; heads the columns `<name>_amplitude_m` and so on, of a strain \
             `<name>_amplitude_strain`",
            "\"tip\"";
        points: Text("group"), "-",
            "usually a point group; for a strain, the surface under a gauge, or nodes, of which all \
             faces count that touch one of them",
            "\"tip_trailing_edge\"  # a physical point of the mesh";
        direction: Numbers(3, ""), "-",
            "not all 0; any length; that of a strain lies in the surface, on which it is projected",
            "[0, 1, 0]";
        quantity: Choice(ObservedQuantity::VARIANTS), "`\"displacement\"`",
            "`\"displacement\"`, or `\"strain\"`, which is what a strain gauge along the direction \
             measures; the first [[observe]] is a displacement",
            "\"strain\"";
    }
}

section! {
    STATIC: RawStatic, "static", Table, "optional",
        "how the steady load is applied",
        "[static]\nload_steps = 10" {
        load_steps: Whole(Some(1), Some(10_000)), (LoadPath::STEPS),
            "the load is applied in this many equal steps, and so is each leg of `[[static.path]]`",
            "10";
        starting_tractions: Whole(Some(0), Some(1000)), "0",
            "`dovetail run` computes the response again from so many other tractions that pairs may have \
             kept: its range is a band in the curve",
            "6";
    } and {
        #[serde(default)]
        pub path: Vec<Spanned<RawPathPoint>>,
    }
}

section! {
    STATIC_PATH: RawPathPoint, "static.path", List, "none or more",
        "a point that the steady load goes through before it comes to what the scene describes",
        "[[static.path]]\nspeed_rpm = 6000" {
        speed_rpm: Number("rpm", Limits::non_negative_below(1e7)), "that of `[rotation]`",
            "speed whose centrifugal load acts at the point. The stiffness stays that of \
             `rotation.speed_rpm`",
            "6000";
        loads: NumberOrList("", Limits::ANY), "1",
            "multiple of all `[[load]]`, or a list with one multiple for each in their order; \
             below 0 a load acts the other way. With `[reduced_model]` one number, the multiple \
             of the whole steady load",
            "[1, 0]  # the first load alone";
    }
}

section! {
    RESPONSE: RawResponse, "response", Table, "required",
        "frequencies, harmonics and how they are solved",
        "[response]\nfrequency_hz = [440.0, 460.0]" {
        frequency_hz: Numbers(2, "Hz"), "- or `times_first_linear_mode`, or `speed_rpm`",
            "`[from, to]` with 0 < from < to, or from = to for one frequency",
            "[440.0, 460.0]";
        times_first_linear_mode: Numbers(2, ""), "- or `frequency_hz`",
            "the same, in multiples of the first linear frequency",
            "[0.98, 1.02]";
        along_engine_order: Whole(Some(1), Some(1000)), "none: the speed stays",
            "the speed of rotation and the frequency move together, with so many cycles of the \
             excitation per revolution: a [run-up](how-to/engine_orders.md). It needs \
             `[rotation]`, whose `speed_rpm` then is that of the static state and of the modes \
             alone",
            "4  # frequency = 4 * speed / 60";
        speed_rpm: Numbers(2, "rpm"), "- or `frequency_hz`",
            "`[from, to]`, the range of a run-up as speeds in place of frequencies, with \
             `along_engine_order`",
            "[4000, 6000]";
        points: Whole(Some(1), Some(1_000_000)), "none",
            "a grid of so many frequencies, evenly spaced, ends included, of which each is solved \
             by itself; without this key the curve is [followed along its \
             length](method.md#following-a-branch), also where it folds, with points where it \
             bends and at its peaks. A run-up always has a grid, of 40 without this key",
            "200";
        // Below it, motions that differ by 1e-3 all satisfy the balance (docs/method.md).
        accuracy: Number("", Limits::open_interval(1e-4, 0.5)), (Resolution::ACCURACY),
            "largest relative error of the observed amplitudes, where `harmonics` is not given, \
             see below",
            "0.01  # of the amplitude";
        harmonics: Whole(Some(1), Some(MOST_HARMONICS)), "none",
            "kept besides the mean, in the place of an accuracy",
            "3";
        compare_harmonics: Whole(Some(1), None), "none",
            "at most `harmonics`; a second response with this many, in the plots alone. Its points \
             that do not converge are crosses there, and count neither in `summary.json` nor in \
             the exit code",
            "1";
        samples: Whole(None, Some(Resolution::MOST_SAMPLES as u32)), (Resolution::SAMPLES),
            "at least 4 `harmonics` + 4; instants of a period at which contact is decided",
            "128";
        eps: Choice(EpsChoice::VARIANTS), "`\"dynamic\"`",
            "`\"dynamic\"`: per pair, the median of the dynamic stiffness over the harmonics; \
             `\"pair\"`: per pair, the diagonal of the static stiffness; `\"spectral_radius\"`: \
             one value for all, the paper's ([method.md](method.md))",
            "\"pair\"";
        eps_scale: Number("", Limits::POSITIVE), (Eps::SCALE),
            "multiplies eps. The static state does not depend on eps",
            "1.0";
        tolerance: Number("", Limits::open_interval(0.0, LARGEST_TOLERANCE)), (Resolution::TOLERANCE),
            "of the relative residual ([method.md](method.md)). The static state takes 1e-10 or \
             this, whichever is smaller",
            "1e-8";
        max_newton_iterations: Whole(Some(1), Some(100_000)), (SweepSettings::MOST_ITERATIONS),
            "of one attempt, see below",
            "60";
        most_seconds_per_frequency: Number("s", Limits::POSITIVE), "none",
            "a frequency that takes longer is given up, with the outcome `time_limit`; the result \
             then depends on the machine",
            "600";
        solver: Choice(Solver::VARIANTS), "`\"newton_krylov\"`",
            "`\"newton_krylov\"` or `\"powell\"`, the paper's; the latter is dense: small models \
             only",
            "\"newton_krylov\"";
        stability: Choice(StabilityScope::VARIANTS), "`\"peaks\"`",
            "motions whose [stability](method.md#stability) is judged by their Floquet multipliers: \
             `\"peaks\"` peaks, turning points, the ends of the range, and every motion of a model \
             with at most 12 pairs; `\"every_point\"`; `\"none\"`",
            "\"every_point\"";
        stuck_modes: Whole(Some(1), Some(10_000)), "as many as are needed",
            "stuck modes kept; without the key those below four times the highest frequency of a \
             kept harmonic, at least 12 and at most 48, and more where the estimated error of the \
             linear curve exceeds 1e-4 ([method.md](method.md#how-many-stuck-modes)); `dovetail \
             verify` takes at least 48",
            "20";
        slip_threshold_m: Number("m", Limits::NOT_NEGATIVE), "1e-5 of the largest static slip, or 1e-9 of the largest elastic compression where that is longer",
            "a pair counts as slipping when it slides farther than this in a period",
            "1e-10";
    }
}

section! {
    ENGINE_ORDER: RawEngineOrder, "engine_order", List, "none or more",
        "an engine order of the Campbell diagram, and what it excites with",
        "[[engine_order]]\norder = 4\ntimes = 1.0" {
        order: Whole(Some(1), Some(1000)), "-",
            "cycles per revolution, each different. `dovetail modes --rpm` lists the crossings of \
             these engine orders, unless `--orders` names others",
            "4";
        times: Number("", Limits::POSITIVE), "none",
            "with it `dovetail modes --rpm` finds the [peak with friction at each crossing \
             ](how-to/engine_orders.md#the-peak-at-each-crossing): the amplitudes of all \
             `[[excitation]]` are multiplied by this number",
            "2.5";
    }
}

section! {
    MISSION: RawMission, "mission", List, "none or more",
        "a vibration that `dovetail wear` wears the contacts by, in turn with the others",
        "[[mission]]\nshare = 0.9\nfrequency_hz = 420.0" {
        share: Number("", Limits::POSITIVE), "1",
            "cycles in it, relative to the shares of the others",
            "0.9";
        frequency_hz: Number("Hz", Limits::POSITIVE), "none: at the peak, wherever it moves",
            "the frequency of the vibration",
            "420.0";
        force_scale: Number("", Limits::POSITIVE), "1",
            "factor on the amplitudes of all excitations",
            "0.5";
    }
}

#[cfg(test)]
pub(crate) mod tests;
