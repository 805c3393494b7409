//! Keys of a scene file. Each entry has the meaning of the key, its unit, its default, its valid
//! values and an example line. Messages take their examples from here, and docs/scene.md its
//! tables.

use super::keys::{Key, Section, Shape, Vocabulary, fields, key};
use super::kinds::{Kind, Limits};
use super::raw;
use dovetail_mesh::units::Units;

/// Upper limit of the tolerance of the relative residual of a balance: a solution with a larger
/// residual does not count as a motion.
pub const LARGEST_TOLERANCE: f64 = 1e-3;

/// Largest number of harmonics; more are taken for a typing error.
const MOST_HARMONICS: u32 = 1000;

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

/// Sections: the top of the file, then the tables in the order in which they are usually written.
const SECTIONS: [Section; 13] = [
    Section {
        name: "",
        shape: Shape::Table,
        needed: "",
        what: "",
        example: "",
        fields: fields::<raw::RawScene>,
        keys: &TOP,
    },
    Section {
        name: "reduced_model",
        shape: Shape::Table,
        needed: "in place of a mesh",
        what: "a reduced model, read from a folder",
        example: "[reduced_model]\nfolder = \"den_hartog\"\nfriction = 0.3\nforce_n = 1.0",
        fields: fields::<raw::RawReducedModel>,
        keys: &REDUCED_MODEL,
    },
    Section {
        name: "mesh",
        shape: Shape::Table,
        needed: "one, or `mesh_file` of each body, or `[reduced_model]`",
        what: "the mesh that bodies share, or the script that gmsh makes it from",
        example: "[mesh]\nfile = \"../meshes/dovetail.msh\"\nmetres_per_unit = 1e-3",
        fields: fields::<raw::RawMesh>,
        keys: &MESH,
    },
    Section {
        name: "body",
        shape: Shape::List,
        needed: "one or more",
        what: "a body, and how it is held",
        example: "[[body]]\nname = \"blade\"\nvolume = \"blade\"\nyoung_pa = 113.8e9",
        fields: fields::<raw::RawBody>,
        keys: &BODY,
    },
    Section {
        name: "rotation",
        shape: Shape::Table,
        needed: "optional",
        what: "the speed about an axis",
        example: "[rotation]\naxis = [1, 0, 0]\nspeed_rpm = 5000",
        fields: fields::<raw::RawRotation>,
        keys: &ROTATION,
    },
    Section {
        name: "contact",
        shape: Shape::List,
        needed: "none or more",
        what: "two flanks that touch, and the law between them",
        example: "[[contact]]\nname = \"left\"\nfirst = \"blade_flank_left\"\n\
                  second = \"jaw_flank_left\"\nfriction = 0.3",
        fields: fields::<raw::RawContact>,
        keys: &CONTACT,
    },
    Section {
        name: "spring",
        shape: Shape::List,
        needed: "none or more",
        what: "a linear spring to ground or between two groups",
        example: "[[spring]]\nname = \"foot\"\nfirst = \"base\"\nstiffness_n_m = 1e6",
        fields: fields::<raw::RawSpring>,
        keys: &SPRING,
    },
    Section {
        name: "load",
        shape: Shape::List,
        needed: "none or more",
        what: "a steady force, traction or pressure",
        example: "[[load]]\non = \"top\"\npressure_pa = 1e6",
        fields: fields::<raw::RawLoad>,
        keys: &LOAD,
    },
    Section {
        name: "damping",
        shape: Shape::Table,
        needed: "required",
        what: "viscous damping of the material",
        example: "[damping]\nratio = 0.001",
        fields: fields::<raw::RawDamping>,
        keys: &DAMPING,
    },
    Section {
        name: "excitation",
        shape: Shape::List,
        needed: "one or more",
        what: "what shakes: a force, traction or pressure, a field of them, or the base",
        example: "[[excitation]]\non = \"excitation\"\ndirection = [0, 1, 0]\nforce_n = 2.0",
        fields: fields::<raw::RawExcitation>,
        keys: &EXCITATION,
    },
    Section {
        name: "observe",
        shape: Shape::List,
        needed: "one or more",
        what: "a displacement that is followed",
        example: "[[observe]]\nname = \"tip\"\npoints = \"tip_trailing_edge\"\n\
                  direction = [0, 1, 0]",
        fields: fields::<raw::RawObserve>,
        keys: &OBSERVE,
    },
    Section {
        name: "static",
        shape: Shape::Table,
        needed: "optional",
        what: "how the steady load is applied",
        example: "[static]\nload_steps = 10",
        fields: fields::<raw::RawStatic>,
        keys: &STATIC,
    },
    Section {
        name: "response",
        shape: Shape::Table,
        needed: "required",
        what: "frequencies, harmonics and how they are solved",
        example: "[response]\nfrequency_hz = [440.0, 460.0]",
        fields: fields::<raw::RawResponse>,
        keys: &RESPONSE,
    },
];

const TOP: [Key; 1] = [key(
    "name",
    Kind::Name,
    "-",
    "a name; results go to `output/<name>`",
    "name = \"paper\"",
)];

const REDUCED_MODEL: [Key; 6] = [
    key(
        "folder",
        Kind::Text("path of a folder"),
        "-",
        "holds [the files](how-to/reduced_model.md#the-folder) that `dovetail reduce` writes",
        "folder = \"den_hartog\"  # K.mtx, M.mtx and the others",
    ),
    key(
        "friction",
        Kind::Number("", Limits::NOT_NEGATIVE),
        "-",
        "Coulomb coefficient of every pair; above 1000 computed as 1000, with a warning",
        "friction = 0.3",
    ),
    key(
        "normal_stiffness_n_m",
        Kind::Number("N/m", Limits::POSITIVE),
        "none: the contact is rigid",
        "spring of every pair against penetration, with `tangential_stiffness_n_m`",
        "normal_stiffness_n_m = 1e9",
    ),
    key(
        "tangential_stiffness_n_m",
        Kind::Number("N/m", Limits::POSITIVE),
        "none: the contact is rigid",
        "spring of every pair against shear, with `normal_stiffness_n_m`",
        "tangential_stiffness_n_m = 1e9",
    ),
    key(
        "gap_m",
        Kind::Number("m", Limits::NOT_NEGATIVE),
        "0",
        "initial clearance of every pair",
        "gap_m = 0.0",
    ),
    key(
        "force_n",
        Kind::Number("N", Limits::NOT_NEGATIVE),
        "-",
        "amplitude of the excitation in all",
        "force_n = 1.0",
    ),
];

const MESH: [Key; 8] = [
    key(
        "geometry",
        Kind::Text("path of a Gmsh script"),
        "- or `file`",
        "meshed by the program `gmsh` in the run; the script is code that runs",
        "geometry = \"../geometry/dovetail.geo\"",
    ),
    key(
        "parameters",
        Kind::NumberTable,
        "`{}`",
        "parameters that the script defines ([those of dovetail.geo](geometry.md)), and options of \
         gmsh; one without effect is an error, see below",
        "parameters = { nu = 4, nv = 9, order = 2 }",
    ),
    key(
        "time_limit_s",
        Kind::Number("s", Limits::between(0.0, 1e9)),
        "120",
        "gmsh is stopped after it",
        "time_limit_s = 120",
    ),
    key(
        "fallback",
        Kind::Text("path of a `.msh`"),
        "none",
        "used where gmsh is missing and `parameters` equal `fallback_parameters`",
        "fallback = \"../meshes/dovetail.msh\"",
    ),
    key(
        "fallback_parameters",
        Kind::NumberTable,
        "none",
        "what `fallback` was made with; required with it, meaningless without",
        "fallback_parameters = { nu = 4, nv = 9, order = 2 }",
    ),
    key(
        "file",
        Kind::Text("path of a mesh"),
        "- or `geometry`",
        "of a [format that is read](how-to/own_mesh.md): MSH, a deck of Abaqus or CalculiX, VTU",
        "file = \"../meshes/dovetail.msh\"",
    ),
    key(
        "metres_per_unit",
        Kind::Number("m", Limits::POSITIVE),
        "- or `units`",
        "1e-3 for a mesh in millimetres",
        "metres_per_unit = 1e-3  # the mesh is in millimetres",
    ),
    key(
        "units",
        Kind::Choice(&UNITS),
        "- or `metres_per_unit`",
        "`\"m-kg-s\"`: metre, kilogram, second (Pa, kg/m3); `\"mm-t-s\"`: millimetre, tonne, second \
         (MPa, t/mm3). What the lengths of the mesh are in, and the materials of a deck",
        "units = \"mm-t-s\"",
    ),
];

/// Words of [`Units::SYSTEMS`].
pub const UNITS: [&str; 2] = [Units::SYSTEMS[0].0, Units::SYSTEMS[1].0];

const BODY: [Key; 19] = [
    key(
        "name",
        Kind::Name,
        "-",
        "a name, each different",
        "name = \"blade\"",
    ),
    key(
        "mesh_file",
        Kind::Text("path of a mesh"),
        "that of `[mesh]`",
        "a mesh of the body's own; its groups are `<body>.<group>` for all other tables, or \
         `<group>` where no other body has one of that name",
        "mesh_file = \"blade.inp\"",
    ),
    key(
        "metres_per_unit",
        Kind::Number("m", Limits::POSITIVE),
        "that of `[mesh]`",
        "of `mesh_file`",
        "metres_per_unit = 1e-3  # the mesh is in millimetres",
    ),
    key(
        "units",
        Kind::Choice(&UNITS),
        "those of `[mesh]`",
        "`\"m-kg-s\"` or `\"mm-t-s\"`, of `mesh_file`, as in `[mesh]`",
        "units = \"mm-t-s\"",
    ),
    key(
        "copy_of",
        Kind::Text("name of a body"),
        "none",
        "takes the mesh of a body above, in its place, and all keys of that body that are not given here",
        "copy_of = \"blade\"",
    ),
    key(
        "rotation_deg",
        Kind::Number("degrees", Limits::ANY),
        "0",
        "turns the mesh of `mesh_file` or `copy_of` about `rotation_axis`, by the right hand",
        "rotation_deg = 12.5",
    ),
    key(
        "rotation_axis",
        Kind::Numbers(3, ""),
        "- where it is turned",
        "direction of the axis of any length",
        "rotation_axis = [1, 0, 0]",
    ),
    key(
        "rotation_point_m",
        Kind::Numbers(3, "m"),
        "`[0, 0, 0]`",
        "a point of the axis",
        "rotation_point_m = [0, 0, 0]",
    ),
    key(
        "translation_m",
        Kind::Numbers(3, "m"),
        "`[0, 0, 0]`",
        "moves the mesh of `mesh_file` or `copy_of`, once it is turned",
        "translation_m = [0, 0, 0.45]",
    ),
    key(
        "volume",
        Kind::Text("group"),
        "- or that of `copy_of`",
        "volume group; each body of a mesh has its own",
        "volume = \"blade\"  # a physical volume of the mesh",
    ),
    key(
        "material",
        Kind::Text("name of a material"),
        "the one that the mesh gives to the volume",
        "a material of a deck, in place of `young_pa`, `poisson` and `density_kg_m3`; it needs `units`",
        "material = \"TITANIUM\"",
    ),
    key(
        "young_pa",
        Kind::Number("Pa", Limits::POSITIVE),
        "- or `material`",
        "Young's modulus",
        "young_pa = 113.8e9",
    ),
    key(
        "poisson",
        Kind::Number("", Limits::between(-1.0, 0.5)),
        "- or `material`",
        "Poisson's ratio",
        "poisson = 0.34",
    ),
    key(
        "density_kg_m3",
        Kind::Number("kg/m3", Limits::POSITIVE),
        "- or `material`",
        "density",
        "density_kg_m3 = 4430",
    ),
    key(
        "fixed",
        Kind::Texts("list of groups"),
        "`[]`",
        "groups of any dimension; their nodes do not move",
        "fixed = [\"jaw_base\"]",
    ),
    key(
        "fixed_x",
        Kind::Texts("list of groups"),
        "`[]`",
        "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
         along the flank, and on both sides of the contact alike",
        "fixed_x = [\"plane_x\"]  # a plane of symmetry",
    ),
    key(
        "fixed_y",
        Kind::Texts("list of groups"),
        "`[]`",
        "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
         along the flank, and on both sides of the contact alike",
        "fixed_y = [\"plane_y\"]  # a plane of symmetry",
    ),
    key(
        "fixed_z",
        Kind::Texts("list of groups"),
        "`[]`",
        "nodes that do not move along that axis: planes of symmetry, rollers. On a flank only \
         along the flank, and on both sides of the contact alike",
        "fixed_z = [\"plane_z\"]  # a plane of symmetry",
    ),
    key(
        "fixed_interface_modes",
        Kind::Whole(Some(0), Some(10_000)),
        "none",
        "the body is first reduced by itself to its contact nodes and so many modes \
         (Craig-Bampton, [method.md](method.md)); without the key it is not",
        "fixed_interface_modes = 6",
    ),
];

const ROTATION: [Key; 5] = [
    key(
        "axis",
        Kind::Numbers(3, ""),
        "-",
        "not all 0; any length",
        "axis = [1, 0, 0]",
    ),
    key(
        "point_m",
        Kind::Numbers(3, "m"),
        "`[0, 0, 0]`",
        "a point of the axis. Metres, not mesh units",
        "point_m = [0, 0, 0]",
    ),
    key(
        "speed_rpm",
        Kind::Number("rpm", Limits::from_zero_to(1e7)),
        "-",
        "speed of rotation",
        "speed_rpm = 5000",
    ),
    key(
        "bodies",
        Kind::Texts("list of body names"),
        "all bodies",
        "the bodies that turn: they have the centrifugal load and the spin softening, and with \
         `\"held_flanks\"` they alone are stiffened",
        "bodies = [\"blade\", \"jaw\"]",
    ),
    key(
        "prestress",
        Kind::Choice(&["contact", "held_flanks", "none"]),
        "`\"contact\"`",
        "`\"contact\"`: geometric stiffness of the static state with contact and friction, in all \
         bodies, repeated until the normal forces stay, and spin softening; `\"held_flanks\"`: that of \
         each body with its contact nodes held, which lacks the stress that a contact hands on; \
         `\"none\"`: the load only",
        "prestress = \"contact\"",
    ),
];

const CONTACT: [Key; 14] = [
    key(
        "name",
        Kind::Name,
        "-",
        "a name, each different",
        "name = \"left\"",
    ),
    key(
        "first",
        Kind::Text("group"),
        "-",
        "surface group of a body",
        "first = \"blade_flank_left\"  # a physical surface of the blade",
    ),
    key(
        "second",
        Kind::Text("group"),
        "rigid ground",
        "surface group that lies opposite `first`, of another body or of the same one; the meshes of \
         the two need not match",
        "second = \"jaw_flank_left\"  # a physical surface of the jaw",
    ),
    key(
        "slave",
        Kind::Choice(&["first", "second"]),
        "the side of the smaller facets; `\"first\"` where they are alike",
        "the slave side, `\"first\"` or `\"second\"`: contact is enforced at its nodes, against the facets \
         of the other side",
        "slave = \"second\"",
    ),
    key(
        "law",
        Kind::Choice(&["unilateral_coulomb", "bonded"]),
        "`\"unilateral_coulomb\"`",
        "`\"unilateral_coulomb\"`: compression only, dry friction; `\"bonded\"`: both sides \
         move as one, and `friction` (then not required), the stiffnesses, `gap_m` and the crown are not \
         used",
        "law = \"bonded\"",
    ),
    key(
        "friction",
        Kind::Number("", Limits::NOT_NEGATIVE),
        "- (`\"bonded\"`: none)",
        "Coulomb coefficient, 0 for a frictionless contact; above 1000 computed as 1000, with a \
         warning",
        "friction = 0.3",
    ),
    key(
        "normal_stiffness_n_m3",
        Kind::Number("N/m3", Limits::POSITIVE),
        "none: the contact is rigid",
        "springs per area against penetration (penalty contact), with `tangential_stiffness_n_m3`: \
         a pressure p presses the sides p / `normal_stiffness_n_m3` into each other",
        "normal_stiffness_n_m3 = 1e14",
    ),
    key(
        "tangential_stiffness_n_m3",
        Kind::Number("N/m3", Limits::POSITIVE),
        "none: the contact is rigid",
        "springs per area against shear, which stretch before the sides slide, with \
         `normal_stiffness_n_m3`",
        "tangential_stiffness_n_m3 = 1e14",
    ),
    key(
        "gap",
        Kind::Choice(&["closed", "mesh"]),
        "`\"closed\"`",
        "`\"closed\"`: the sides touch, however far apart the mesh has them; `\"mesh\"`: their distance in \
         the mesh is clearance (on curved sides that do not match it alternates from node to node)",
        "gap = \"mesh\"",
    ),
    key(
        "gap_m",
        Kind::Number("m", Limits::ANY),
        "0",
        "initial clearance, added to that of `gap`; negative where the sides interfere (a press fit), \
         which is applied with the steady load",
        "gap_m = 0.0",
    ),
    key(
        "search_distance_m",
        Kind::Number("m", Limits::POSITIVE),
        "half of the longest edge of both facets",
        "facets farther apart than this along their normals are not opposite each other",
        "search_distance_m = 0.5e-3",
    ),
    key(
        "crown_radius_m",
        Kind::Number("m", Limits::POSITIVE),
        "none",
        "adds the clearance d^2 / (2 `crown_radius_m`)",
        "crown_radius_m = 2.0",
    ),
    key(
        "crown_axis",
        Kind::Numbers(3, ""),
        "none",
        "along the flank, any length; only with `crown_radius_m`",
        "crown_axis = [1, 0, 0]  # a cylinder along x",
    ),
    key(
        "crown_centre_m",
        Kind::Numbers(3, "m"),
        "centroid of the flank",
        "only with `crown_radius_m`",
        "crown_centre_m = [0, 0, 0.45]",
    ),
];

const SPRING: [Key; 5] = [
    key(
        "name",
        Kind::Name,
        "-",
        "a name, each different",
        "name = \"foot\"",
    ),
    key(
        "first",
        Kind::Text("group"),
        "-",
        "part of the surface of one body, or a group of its nodes",
        "first = \"base\"  # a physical surface or point of the mesh",
    ),
    key(
        "second",
        Kind::Text("group"),
        "ground",
        "the same, of another body or of the same one: the spring joins the mean displacements of the two; \
         left out, it is a foundation under all of `first`, on ground that moves with the base",
        "second = \"frame\"",
    ),
    key(
        "stiffness_n_m",
        Kind::Number("N/m", Limits::POSITIVE),
        "-",
        "in all, not per area or node: to ground it is shared by the area of a surface, or equally by \
         the nodes of a group",
        "stiffness_n_m = 1e6",
    ),
    key(
        "direction",
        Kind::Numbers(3, ""),
        "all three axes",
        "the spring acts along it alone; not all 0, any length",
        "direction = [0, 0, 1]",
    ),
];

const LOAD: [Key; 5] = [
    key(
        "on",
        Kind::Text("group"),
        "-",
        "points or a curve (a force is shared equally by the nodes), or part of the surface of one body (spread \
         uniformly over its area)",
        "on = \"top\"  # a physical surface or point of the mesh",
    ),
    key(
        "force_n",
        Kind::Number("N", Limits::NOT_NEGATIVE),
        "- or `traction_pa`, `pressure_pa`",
        "the whole force",
        "force_n = 100.0",
    ),
    key(
        "traction_pa",
        Kind::Number("Pa", Limits::NOT_NEGATIVE),
        "- or `force_n`, `pressure_pa`",
        "force over area along `direction`; surfaces only",
        "traction_pa = 1e5",
    ),
    key(
        "direction",
        Kind::Numbers(3, ""),
        "- or `pressure_pa`",
        "of a force or traction, not all 0; any length",
        "direction = [0, 0, -1]",
    ),
    key(
        "pressure_pa",
        Kind::Number("Pa", Limits::ANY),
        "- or `force_n`, `traction_pa`",
        "acts along the inward normal; surfaces only",
        "pressure_pa = 1e6",
    ),
];

const DAMPING: [Key; 4] = [
    key(
        "ratio",
        Kind::Number("", Limits::from_zero_to(1.0)),
        "- or `stiffness_s`, `mass_per_s`",
        "share of critical damping on linear mode `linear_mode`, by stiffness-proportional damping",
        "ratio = 0.001",
    ),
    key(
        "linear_mode",
        Kind::Whole(Some(1), Some(10_000)),
        "1",
        "no more than `response.stuck_modes` where that is given; only with `ratio`",
        "linear_mode = 1",
    ),
    key(
        "stiffness_s",
        Kind::Number("s", Limits::NOT_NEGATIVE),
        "0",
        "C = `stiffness_s` K + `mass_per_s` M",
        "stiffness_s = 1e-6",
    ),
    key(
        "mass_per_s",
        Kind::Number("1/s", Limits::NOT_NEGATIVE),
        "0",
        "see `stiffness_s`",
        "mass_per_s = 0.1",
    ),
];

const EXCITATION: [Key; 11] = [
    key(
        "on",
        Kind::Text("group"),
        "- or a base",
        "as `load.on`",
        "on = \"excitation\"  # a physical point or surface of the mesh",
    ),
    key(
        "force_n",
        Kind::Number("N", Limits::NOT_NEGATIVE),
        "- or another cause",
        "amplitude of the whole force",
        "force_n = 2.0",
    ),
    key(
        "traction_pa",
        Kind::Number("Pa", Limits::NOT_NEGATIVE),
        "- or another cause",
        "amplitude of the force over area along `direction`; surfaces only",
        "traction_pa = 500.0",
    ),
    key(
        "direction",
        Kind::Numbers(3, ""),
        "- or `pressure_pa`, `file`",
        "of a force, a traction or the base, not all 0; any length",
        "direction = [0, 1, 0]",
    ),
    key(
        "pressure_pa",
        Kind::Number("Pa", Limits::ANY),
        "- or another cause",
        "amplitude along the inward normal; surfaces only",
        "pressure_pa = 200.0",
    ),
    key(
        "file",
        Kind::Text("path of a CSV file"),
        "- or another cause",
        "complex pressures or forces at points in space, [mapped to the \
         surface](how-to/surface_excitation.md#pressures-of-a-flow)",
        "file = \"pressure.csv\"",
    ),
    key(
        "factor",
        Kind::Number("", Limits::NOT_NEGATIVE),
        "1",
        "multiplies the values of `file`",
        "factor = 1.0",
    ),
    key(
        "base_acceleration_m_s2",
        Kind::Number("m/s2", Limits::NOT_NEGATIVE),
        "- or another cause",
        "amplitude along `direction` of all supports, of rigid ground and of the ground of springs, which move as one; displacements are then \
         [relative to them](how-to/surface_excitation.md#a-base-that-shakes)",
        "base_acceleration_m_s2 = 9.81",
    ),
    key(
        "base_displacement_m",
        Kind::Number("m", Limits::NOT_NEGATIVE),
        "- or another cause",
        "the same, given by the amplitude of the displacement",
        "base_displacement_m = 1e-5",
    ),
    key(
        "harmonic",
        Kind::Whole(Some(1), Some(MOST_HARMONICS)),
        "1",
        "at most `response.harmonics`",
        "harmonic = 1",
    ),
    key(
        "phase_deg",
        Kind::Number("degrees", Limits::ANY),
        "0",
        "by which the cause lags behind cos(w t)",
        "phase_deg = 0.0",
    ),
];

const OBSERVE: [Key; 3] = [
    key(
        "name",
        Kind::Name,
        "-",
        "a name, each different; heads the columns `<name>_amplitude_m` and so on",
        "name = \"tip\"",
    ),
    key(
        "points",
        Kind::Text("group"),
        "-",
        "usually a point group",
        "points = \"tip_trailing_edge\"  # a physical point of the mesh",
    ),
    key(
        "direction",
        Kind::Numbers(3, ""),
        "-",
        "not all 0; any length",
        "direction = [0, 1, 0]",
    ),
];

const STATIC: [Key; 1] = [key(
    "load_steps",
    Kind::Whole(Some(1), Some(10_000)),
    "10",
    "the load is applied in this many equal steps",
    "load_steps = 10",
)];

const RESPONSE: [Key; 15] = [
    key(
        "frequency_hz",
        Kind::Numbers(2, "Hz"),
        "- or `times_first_linear_mode`",
        "`[from, to]` with 0 < from < to, or from = to for one frequency",
        "frequency_hz = [440.0, 460.0]",
    ),
    key(
        "times_first_linear_mode",
        Kind::Numbers(2, ""),
        "- or `frequency_hz`",
        "the same, in multiples of the first linear frequency",
        "times_first_linear_mode = [0.98, 1.02]",
    ),
    key(
        "points",
        Kind::Whole(Some(1), Some(1_000_000)),
        "none",
        "a grid of so many frequencies, evenly spaced, ends included, of which each is solved by \
         itself; without this key the curve is [followed along its \
         length](method.md#following-a-branch), also where it folds, with points where it bends and \
         at its peaks",
        "points = 200",
    ),
    key(
        "accuracy",
        // Below it, motions that differ by 1e-3 all satisfy the balance (docs/method.md).
        Kind::Number("", Limits::between(1e-4, 0.5)),
        "0.01",
        "largest relative error of the observed amplitudes, where `harmonics` is not given, see \
         below",
        "accuracy = 0.01  # of the amplitude",
    ),
    key(
        "harmonics",
        Kind::Whole(Some(1), Some(MOST_HARMONICS)),
        "none",
        "kept besides the mean, in the place of an accuracy",
        "harmonics = 3",
    ),
    key(
        "compare_harmonics",
        Kind::Whole(Some(1), None),
        "none",
        "at most `harmonics`; a second response with this many, in the plots alone. Its points \
         that do not converge are crosses there, and count neither in `summary.json` nor in the \
         exit code",
        "compare_harmonics = 1",
    ),
    key(
        "samples",
        Kind::Whole(None, Some(1 << 20)),
        "128",
        "at least 4 `harmonics` + 4; instants of a period at which contact is decided",
        "samples = 128",
    ),
    key(
        "eps",
        Kind::Choice(&["dynamic", "pair", "spectral_radius"]),
        "`\"dynamic\"`",
        "`\"dynamic\"`: per pair, the median of the dynamic stiffness over the harmonics; \
         `\"pair\"`: per pair, the diagonal of the static stiffness; `\"spectral_radius\"`: \
         one value for all, the paper's ([method.md](method.md))",
        "eps = \"pair\"",
    ),
    key(
        "eps_scale",
        Kind::Number("", Limits::POSITIVE),
        "1",
        "multiplies eps. The static state does not depend on eps",
        "eps_scale = 1.0",
    ),
    key(
        "tolerance",
        Kind::Number("", Limits::between(0.0, LARGEST_TOLERANCE)),
        "1e-8",
        "of the relative residual ([method.md](method.md)). The static state takes 1e-10 or \
         this, whichever is smaller",
        "tolerance = 1e-8",
    ),
    key(
        "max_newton_iterations",
        Kind::Whole(Some(1), Some(100_000)),
        "60",
        "of one attempt, see below",
        "max_newton_iterations = 60",
    ),
    key(
        "most_seconds_per_frequency",
        Kind::Number("s", Limits::POSITIVE),
        "none",
        "a frequency that takes longer is given up, with the outcome `time_limit`; the result \
         then depends on the machine",
        "most_seconds_per_frequency = 600",
    ),
    key(
        "solver",
        Kind::Choice(&["newton_krylov", "powell"]),
        "`\"newton_krylov\"`",
        "`\"newton_krylov\"` or `\"powell\"`, the paper's; the latter is dense: small models \
         only",
        "solver = \"newton_krylov\"",
    ),
    key(
        "stuck_modes",
        Kind::Whole(Some(1), Some(10_000)),
        "as many as are needed",
        "stuck modes kept; without the key those below four times the highest frequency of a \
         kept harmonic, at least 12 and at most 48, and more where the estimated error of the \
         linear curve exceeds 1e-4 ([method.md](method.md#how-many-stuck-modes)); `dovetail verify` \
         takes at least 48",
        "stuck_modes = 20",
    ),
    key(
        "slip_threshold_m",
        Kind::Number("m", Limits::NOT_NEGATIVE),
        "1e-5 of the largest static slip",
        "a pair counts as slipping when it slides farther than this in a period",
        "slip_threshold_m = 1e-10",
    ),
];

#[cfg(test)]
pub(crate) mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::error::{Fault, SceneError};
    use crate::scene::parse;

    /// Scene with every section, in which each key of `section` can be given.
    pub(crate) fn scene_with(section: &str, key: &str) -> String {
        let mesh = match key {
            "file" => "file = \"a.msh\"",
            "fallback" | "fallback_parameters" => {
                "geometry = \"a.geo\"\nfallback = \"a.msh\"\nfallback_parameters = {}"
            }
            _ => "geometry = \"a.geo\"",
        };
        let load = match key {
            "pressure_pa" => "pressure_pa = 1.0",
            "traction_pa" => "traction_pa = 1.0\ndirection = [1, 0, 0]",
            _ => "force_n = 1.0\ndirection = [1, 0, 0]",
        };
        let cause = match key {
            "file" | "factor" => "on = \"p\"\nfile = \"p.csv\"".to_owned(),
            "base_acceleration_m_s2" | "base_displacement_m" => {
                format!("{key} = 1.0\ndirection = [1, 0, 0]")
            }
            _ => format!("on = \"p\"\n{load}"),
        };
        let damping = match key {
            "stiffness_s" => "mass_per_s = 1.0",
            "mass_per_s" => "stiffness_s = 1.0",
            _ => "ratio = 0.001",
        };
        let range = match key {
            "frequency_hz" => "frequency_hz = [1, 2]",
            _ => "times_first_linear_mode = [0.9, 1.1]",
        };
        let body = "young_pa = 1e11\npoisson = 0.3\ndensity_kg_m3 = 4000";
        let own = match (section, key) {
            ("body", "metres_per_unit") => "mesh_file = \"a.msh\"\n",
            ("body", "units") => "mesh_file = \"a.inp\"\n",
            ("body", "rotation_axis") => "mesh_file = \"a.msh\"\nrotation_deg = 1\n",
            ("body", "rotation_deg" | "rotation_point_m" | "translation_m") => {
                "mesh_file = \"a.msh\"\nrotation_axis = [1, 0, 0]\n"
            }
            _ => "",
        };
        let subject = match section {
            "reduced_model" => {
                "[reduced_model]\nfolder = \"a\"\nfriction = 0.3\nforce_n = 1".to_owned()
            }
            _ => format!(
                "[mesh]\n{mesh}\nmetres_per_unit = 1e-3\n\
                 [[body]]\nname = \"a\"\n{own}volume = \"a\"\n{body}\n\
                 [[body]]\nname = \"b\"\nvolume = \"b\"\n{body}\nfixed = [\"base\"]\n\
                 [rotation]\naxis = [1, 0, 0]\nspeed_rpm = 5000\n\
                 [[contact]]\nname = \"c\"\nfirst = \"a1\"\nsecond = \"b1\"\nfriction = 0.3\n\
                 crown_radius_m = 1.0\n\
                 [[spring]]\nname = \"s\"\nfirst = \"a3\"\nstiffness_n_m = 1e6\n\
                 [[load]]\non = \"a2\"\n{load}\n\
                 [[excitation]]\n{cause}\n\
                 [[observe]]\nname = \"tip\"\npoints = \"p\"\ndirection = [1, 0, 0]"
            ),
        };
        let resolution = match key {
            "samples" | "tolerance" => "harmonics = 3\n",
            _ => "",
        };
        format!(
            "name = \"s\"\n{subject}\n[damping]\n{damping}\n[static]\n[response]\n{range}\n{resolution}"
        )
    }

    fn parsed(section: &Section, key: &Key, value: &str) -> (String, Vec<Fault>) {
        let text = scene_with(section.name, key.name);
        let path = match section.shape {
            Shape::Table => format!("{}.{}", section.name, key.name),
            Shape::List => format!("{}.0.{}", section.name, key.name),
        };
        let set = match value {
            "" => vec![],
            value => vec![format!("{path}={value}")],
        };
        let path = match section.name {
            "body" => format!("body.a.{}", key.name),
            "contact" => format!("contact.c.{}", key.name),
            "spring" => format!("spring.s.{}", key.name),
            "observe" => format!("observe.tip.{}", key.name),
            _ => path,
        };
        match parse(&text, "scene.toml", Path::new(""), &set) {
            Ok(scene) => (format!("{scene:?}"), vec![]),
            Err(SceneError::Invalid { problems }) => {
                (path, problems.into_iter().map(|p| p.fault).collect())
            }
            Err(error) => panic!("{error}"),
        }
    }

    fn is_out_of_range(section: &Section, key: &Key, value: &str) -> bool {
        let (path, faults) = parsed(section, key, value);
        let of_key = |f: &Fault| match f {
            Fault::OutOfRange { path: found, .. } => *found == path,
            Fault::NoHarmonic => key.name == "harmonics",
            _ => false,
        };
        faults.iter().any(of_key)
    }

    pub(crate) fn all_keys() -> impl Iterator<Item = (&'static Section, &'static Key)> {
        SECTIONS
            .iter()
            .filter(|s| !s.name.is_empty())
            .flat_map(|s| s.keys.iter().map(move |k| (s, k)))
    }

    /// Values within the limits of a kind and values just outside; `None` if the kind is not a
    /// number.
    pub(crate) fn probes(kind: Kind) -> Option<(Vec<String>, Vec<String>)> {
        let text = |v: f64| format!("{v:e}");
        let step = |v: f64| v.abs().max(1e-30) * 1e-9;
        let (inside, outside) = match kind {
            Kind::Whole(least, most) => {
                let below = least.filter(|l| *l > 0).map(|l| l - 1);
                let inside = least.into_iter().chain(most);
                let outside = below.into_iter().chain(most.map(|m| m + 1));
                let texts = |v: Vec<u32>| v.iter().map(u32::to_string).collect();
                return Some((texts(inside.collect()), texts(outside.collect())));
            }
            Kind::Number(_, limits) => {
                let Limits { above, below, from } = limits;
                let least = if from {
                    (above, above - step(above))
                } else {
                    (above + step(above), above)
                };
                let ends = [least, (below - step(below), below)];
                let open = [(-1e300, above.is_finite()), (1e300, below.is_finite())];
                let inside = ends.iter().zip(open).map(
                    |((inside, _), (far, is_limit))| {
                        if is_limit { *inside } else { far }
                    },
                );
                let outside = ends.iter().zip(open);
                let outside = outside.filter(|(_, (_, is_limit))| *is_limit);
                (
                    inside.collect::<Vec<f64>>(),
                    outside
                        .map(|((_, outside), _)| *outside)
                        .collect::<Vec<f64>>(),
                )
            }
            _ => return None,
        };
        let texts = |v: Vec<f64>| v.into_iter().map(text).collect();
        Some((texts(inside), texts(outside)))
    }

    #[test]
    fn documented_limits_are_those_of_the_checks() {
        let mut probed = 0;
        for (section, key) in all_keys() {
            let Some((inside, outside)) = probes(key.kind) else {
                continue;
            };
            probed += 1;
            for value in inside {
                assert!(
                    !is_out_of_range(section, key, &value),
                    "{} = {value}",
                    key.name
                );
            }
            for value in outside {
                assert!(
                    is_out_of_range(section, key, &value),
                    "{} = {value}",
                    key.name
                );
            }
        }
        assert!(probed > 30, "{probed} keys");
    }

    /// Values of other types than the kind.
    pub(crate) fn wrong_types(kind: Kind) -> &'static [&'static str] {
        match kind {
            Kind::Text(_) | Kind::Name | Kind::Choice(_) => &["1", "[]", "true"],
            Kind::Texts(_) | Kind::Choices(_) => &["\"a\"", "[1]", "1"],
            Kind::Number(..) => &["\"a\"", "[1]", "true", "inf"],
            Kind::Whole(..) => &["0.5", "\"a\"", "-1"],
            Kind::Numbers(2, _) => &["[1]", "[1, 2, 3]", "1", "[1, \"a\"]"],
            Kind::Numbers(_, _) => &["[1, 2]", "[1, 2, 3, 4]", "1"],
            Kind::NumberTable => &["{ a = \"b\" }", "1"],
            Kind::Flag => &["\"true\"", "1"],
            Kind::List => &["1", "\"a\""],
            Kind::Any(_) => &[],
        }
    }

    #[test]
    fn documented_types_are_those_of_the_mirror() {
        for (section, key) in all_keys() {
            let is_wrong_type = |value: &str| {
                let faults = parsed(section, key, value).1;
                faults.iter().any(|f| matches!(f, Fault::WrongType { .. }))
            };
            let example: toml::Table = key.example.parse().unwrap();
            let right = example[key.name].to_string();
            assert!(!is_wrong_type(&right), "{} = {right}", key.name);
            for value in wrong_types(key.kind) {
                assert!(is_wrong_type(value), "{} = {value}", key.name);
            }
        }
    }

    #[test]
    fn what_is_required_is_missed() {
        let is_missed = |section: &Section, key: &Key| {
            let faults = parsed(section, key, " ").1;
            let missing = |f: &Fault| match f {
                Fault::MissingKey { path, .. } => path.ends_with(key.name),
                _ => false,
            };
            faults.iter().any(missing)
        };
        for (section, key) in all_keys() {
            if key.is_required() {
                assert!(is_missed(section, key), "{}.{}", section.name, key.name);
            }
        }
    }

    #[test]
    fn documented_defaults_change_nothing() {
        let mut written = 0;
        for (section, key) in all_keys() {
            let Some(default) = key.default_value() else {
                continue;
            };
            written += 1;
            let (without, faults) = parsed(section, key, "");
            assert!(faults.is_empty(), "{}: {faults:?}", key.name);
            let (with, _) = parsed(section, key, &default.to_string());
            assert_eq!(with, without, "{}.{}", section.name, key.name);
        }
        assert!(written > 20, "{written} keys");
    }

    #[test]
    fn documented_words_are_those_of_the_checks() {
        let mut chosen = 0;
        for (section, key) in all_keys() {
            let (_, faults) = parsed(section, key, "\"no such word\"");
            let words = faults.iter().find_map(|f| match f {
                Fault::UnknownChoice { valid, .. } => Some(*valid),
                _ => None,
            });
            for word in words.unwrap_or_default() {
                chosen += 1;
                assert!(
                    key.meaning.contains(&format!("`\"{word}\"`")),
                    "{}: {word}",
                    key.name
                );
            }
            let listed = match key.kind {
                Kind::Choice(listed) => listed,
                _ => &[],
            };
            assert_eq!(listed, words.unwrap_or_default(), "{}", key.name);
        }
        assert!(chosen > 7, "{chosen} words");
    }
}
