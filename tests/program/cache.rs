//! Results of an earlier run are reused if their inputs have not changed, and the results are the
//! same to the last bit.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shared_folder::{Folder, drop_sections, files_below};
use crate::shared_program::{ended, has, program, said, told};
use crate::shared_runs::{json, summary};
use dovetail_testkit::folder::root;

const SCENE: &str = "scenes/verification/patch.toml";
const ENTRIES: &str = "dovetail-cache-1";

/// Folder with a cache, results, and a program in place of gmsh that copies a ready mesh.
struct Bench(Folder);

impl Bench {
    fn new(name: &str) -> Self {
        let bench = Self(Folder::new(name));
        bench.gmsh("4.99");
        bench
    }

    /// Installs a program in place of gmsh that writes the whole mesh.
    fn gmsh(&self, version: &str) {
        self.gmsh_that_writes(version, "cat");
    }

    /// Installs a program in place of gmsh that writes the output of the command `part`. A separate
    /// shell writes its file: starting a file that this process has open for writing may fail.
    fn gmsh_that_writes(&self, version: &str, part: &str) {
        let mesh = root().join("meshes/verification/patch.msh");
        let text = format!(
            "#!/bin/sh\nif [ \"$1\" = --version ]; then echo {version}; exit; fi\necho run >> \"$0.runs\"\n\
             for last; do :; done\n{part} '{}' > \"$last\"\necho \"Info : Running [Gmsh {version}, 1 node]\"\necho 'Warning : thin'\n",
            mesh.display()
        );
        let shell = "printf %s \"$1\" > \"$2\" && chmod +x \"$2\"";
        let gmsh = self.0.join("gmsh");
        let arguments = ["-c", shell, "sh", &text].map(std::ffi::OsStr::new);
        let status = Command::new("sh").args(arguments).arg(&gmsh).status();
        assert!(status.unwrap().success());
    }

    fn meshed(&self) -> usize {
        let runs = std::fs::read_to_string(self.0.join("gmsh.runs"));
        runs.map_or(0, |runs| runs.lines().count())
    }

    fn cache(&self) -> PathBuf {
        self.0.join("cache")
    }

    fn command(&self, command: &str, out: &str, set: &[&str]) -> Command {
        let mut program = self.with_gmsh(program(root(), &[command]));
        program
            .env("DOVETAIL_CACHE", self.cache())
            .env_remove("DOVETAIL_CACHE_LIMIT_GIB")
            .arg(root().join(SCENE))
            .arg("--out")
            .arg(self.0.join(out))
            // No modes of single bodies: most of the time of this small reduction.
            .args(["--set", "body.*.fixed_interface_modes=0"])
            .args(set.iter().flat_map(|set| ["--set", set]));
        program
    }

    /// The command with the program in place of gmsh.
    fn with_gmsh(&self, mut command: Command) -> Command {
        let path = std::env::var("PATH").unwrap_or_default();
        command
            .env("PATH", format!("{}:{path}", self.0.display()))
            .env("HOME", &self.0)
            .env_remove("GMSH_HOME");
        command
    }

    /// Stages of `dovetail static` that came from the cache: mesh, reduction.
    fn kept(&self, set: &[&str]) -> [bool; 2] {
        ended(self.command("static", "kept", set), 0);
        self.stages("kept")
    }

    fn stages(&self, out: &str) -> [bool; 2] {
        let summary = summary(&self.0.join(out));
        let stages = summary["stages"].as_array().unwrap();
        ["mesh", "reduction"].map(|name| {
            let stage = stages.iter().find(|s| s["name"] == name).unwrap();
            stage["from_cache"].as_bool().unwrap()
        })
    }

    /// All files of a run except summary.json, which has times. The sections of the report about
    /// the effort of the run and about unusable entries are left out.
    fn files(&self, out: &str) -> BTreeMap<PathBuf, Vec<u8>> {
        let root = self.0.join(out);
        let mut files = files_below(&root);
        files.retain(|path| !path.ends_with("summary.json"));
        let content = |path: PathBuf| {
            let name = path.strip_prefix(&root).unwrap().to_path_buf();
            let bytes = std::fs::read(&path).unwrap();
            (name, drop_sections(bytes, &["effort", "warnings"]))
        };
        files.into_iter().map(content).collect()
    }

    /// Entries in the folder of the cache, without the file that marks it.
    fn entries(&self) -> Vec<PathBuf> {
        let files = std::fs::read_dir(self.cache().join(ENTRIES));
        let files = files.map_or(Vec::new(), |files| files.flatten().collect());
        let paths = files.into_iter().map(|f| f.path());
        paths.filter(|p| !p.ends_with("CACHEDIR.TAG")).collect()
    }

    fn entry(&self, kind: &str) -> PathBuf {
        let is_it = |path: &PathBuf| {
            let name = path.file_name().unwrap().to_string_lossy();
            name.starts_with(kind)
        };
        self.entries().into_iter().find(is_it).unwrap()
    }
}

#[track_caller]
fn assert_same(a: &BTreeMap<PathBuf, Vec<u8>>, b: &BTreeMap<PathBuf, Vec<u8>>) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in a {
        assert!(b[name] == *bytes, "{} differs", name.display());
    }
}

#[test]
fn with_and_without_cache_the_results_are_the_same_to_the_last_bit() {
    let bench = Bench::new("bits");
    let one = ["contact.0.friction=0.3"];
    let two = [
        "contact.0.friction=0.01",
        "excitation.0.force_n=300",
        "excitation.0.phase_deg=40",
    ];
    for (set, warm) in [(&one[..], false), (&two[..], true)] {
        let mut plain = bench.command("run", "plain", set);
        plain.arg("--no-cache");
        ended(plain, 0);
        let first = ended(bench.command("run", "first", set), 0);
        assert_eq!(bench.stages("first"), [warm, warm]);
        let second = ended(bench.command("run", "second", set), 0);
        assert_eq!(bench.stages("second"), [true, true]);
        assert_eq!(said(&first).matches("gmsh: thin").count(), 1);
        assert_eq!(said(&second).matches("gmsh: thin").count(), 1);
        let plain = bench.files("plain");
        assert!(plain.contains_key(Path::new("response.csv")) && plain.len() > 15);
        assert_same(&bench.files("first"), &plain);
        assert_same(&bench.files("second"), &plain);
    }
    // Plain runs mesh each time, the others once.
    assert_eq!(bench.meshed(), 3);
}

#[test]
fn laws_forces_and_frequencies_change_without_another_reduction() {
    let bench = Bench::new("hits");
    assert_eq!(bench.kept(&[]), [false, false]);
    for set in [
        "contact.0.friction=0.1",
        "contact.0.gap_m=1e-9",
        "contact.0.crown_radius_m=1e4",
        "contact.0.name=other",
        "excitation.0.force_n=3",
        "excitation.0.phase_deg=30",
        "response.points=7",
        "response.samples=256",
        "response.tolerance=1e-7",
        "damping.ratio=0.02",
        "static.load_steps=2",
        "contact.0.search_distance_m=1e-4",
        "mesh.time_limit_s=60",
        "mesh.parameters.nx=5",
    ] {
        // The name of a contact heads columns: it is part of the model, and the price of a new one
        // is a reduction.
        let reduced = set != "contact.0.name=other";
        assert_eq!(bench.kept(&[set]), [true, reduced], "{set}");
    }
    // More harmonics, or a force at another one, may ask for modes beyond those that are kept.
    for set in [
        &["response.harmonics=6"][..],
        &["response.harmonics=6", "excitation.0.harmonic=3"],
    ] {
        assert_eq!(bench.kept(set), [true, false]);
        assert_eq!(bench.kept(set), [true, true]);
    }
    let modes = "response.stuck_modes=20";
    assert_eq!(bench.kept(&[modes]), [true, false]);
    assert_eq!(bench.kept(&[modes, "response.harmonics=6"]), [true, true]);
}

/// The stress of the static state depends on the laws of the contacts, and on how the state is
/// found.
#[test]
fn with_the_prestress_of_the_static_state_its_laws_and_steps_count() {
    let bench = Bench::new("prestress");
    let rotation = "rotation={ axis = [0, 0, 1], speed_rpm = 10, prestress = \"contact\" }";
    assert_eq!(bench.kept(&[rotation]), [false, false]);
    assert_eq!(bench.kept(&[rotation]), [true, true]);
    for set in [
        "contact.0.friction=0.1",
        "contact.0.gap_m=1e-9",
        "contact.0.gap_m=-1e-9",
        "static.load_steps=2",
        "response.tolerance=1e-11",
    ] {
        assert_eq!(bench.kept(&[rotation, set]), [true, false], "{set}");
        assert_eq!(bench.kept(&[rotation, set]), [true, true], "{set}");
    }
    let force = "excitation.0.force_n=3";
    assert_eq!(bench.kept(&[rotation, force]), [true, true]);
}

#[test]
fn whatever_the_reduced_model_depends_on_is_noticed() {
    let bench = Bench::new("misses");
    assert_eq!(bench.kept(&[]), [false, false]);
    for set in [
        "body.0.young_pa=101e9",
        "body.1.poisson=0.31",
        "body.0.density_kg_m3=4501",
        "body.1.fixed_interface_modes=5",
        "body.1.fixed=[\"lower_base\"]",
        "body.1.fixed_y=[\"lower_rail\"]",
        "load.0.pressure_pa=51e6",
        "excitation.0.direction=[0, 1, 0]",
        "excitation.0.on=upper_flank",
        "observe.0.direction=[1, 0, 0]",
        "observe.0.points=upper_top",
        "response.stuck_modes=20",
        "contact.0.law=bonded",
        "mesh.metres_per_unit=2e-3",
        "rotation={ axis = [0, 0, 1], speed_rpm = 10 }",
        "rotation={ axis = [0, 0, 1], speed_rpm = 11 }",
        "rotation={ axis = [0, 0, 1], speed_rpm = 10, point_m = [0, 0.01, 0] }",
        "rotation={ axis = [0, 0, 1], speed_rpm = 10, bodies = [\"upper\"] }",
        "rotation={ axis = [0, 0, 1], speed_rpm = 10, prestress = \"none\" }",
    ] {
        assert_eq!(bench.kept(&[set]), [true, false], "{set}");
    }
    assert_eq!(bench.kept(&["load.0.pressure_pa=51e6"]), [true, true]);
    // Another mesh file with the same nodes is the same model, another one is not.
    let file = |name: &str| format!("mesh.file=../../meshes/verification/{name}.msh");
    assert_eq!(bench.kept(&[&file("patch")]), [false, true]);
    let mut mesh = std::fs::read(root().join("meshes/verification/patch.msh")).unwrap();
    // A coordinate of a node, moved by little: a number in the middle of the nodes.
    let z = 10.0f64.to_le_bytes();
    let at = mesh
        .windows(8)
        .rposition(|w| w == z)
        .expect("a node at z = 10");
    mesh[at..at + 8].copy_from_slice(&10.000001f64.to_le_bytes());
    let edited = bench.0.write("edited.msh", mesh);
    let set = format!("mesh.file={}", edited.display());
    assert_eq!(bench.kept(&[&set]), [false, false]);
}

#[test]
fn gmsh_runs_again_where_its_script_parameters_settings_or_version_changed() {
    let bench = Bench::new("mesh");
    let text = std::fs::read_to_string(root().join("geometry/verification/patch.geo")).unwrap();
    let script = bench.0.write("patch.geo", &text);
    let geometry = format!("mesh.geometry={}", script.display());
    let set = [geometry.as_str()];
    assert_eq!(bench.kept(&set), [false, false]);
    // Here the mesh is the same all the same: its reduction is known.
    assert_eq!(bench.kept(&set), [true, true]);
    assert_eq!(
        bench.kept(&[&geometry, "mesh.parameters.nx=6"]),
        [false, true]
    );
    bench.0.write("patch.geo", format!("{text}// changed\n"));
    assert_eq!(bench.kept(&set), [false, true]);
    bench.gmsh("4.100");
    assert_eq!(bench.kept(&set), [false, true]);
    bench.0.write(".gmsh-options", "Mesh.Algorithm = 5;");
    assert_eq!(bench.kept(&set), [false, true]);
    assert_eq!(bench.kept(&set), [true, true]);
    // What a script includes is not in its bytes: never kept.
    bench
        .0
        .write("patch.geo", format!("Include \"other.geo\";\n{text}"));
    assert_eq!(bench.kept(&set), [false, true]);
    assert_eq!(bench.kept(&set), [false, true]);
    assert_eq!(bench.meshed(), 7);
}

#[test]
fn a_damaged_entry_is_noticed_and_made_anew() {
    let bench = Bench::new("damage");
    ended(bench.command("run", "first", &[]), 0);
    let right = bench.files("first");
    for kind in ["mesh", "reduced", "recovery"] {
        for cut in [kind == "mesh", true] {
            let entry = bench.entry(kind);
            let mut bytes = std::fs::read(&entry).unwrap();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            if cut {
                bytes.truncate(middle);
            }
            std::fs::write(&entry, bytes).unwrap();
            let again = || told(bench.command("run", "again", &[]), 0);
            let told = again();
            let warnings = told.matches("is of no use").count();
            assert!(warnings == 1 && told.contains(kind), "{kind}: {told}");
            assert_same(&bench.files("again"), &right);
            assert!(!again().contains("of no use"));
        }
    }
}

/// gmsh on a full disk writes only part of the mesh, and ends with exit code 0.
#[test]
fn a_mesh_that_is_not_whole_is_an_error_and_is_not_kept() {
    let bench = Bench::new("half");
    for part in ["head -c 30000", "head -c 0", "head -c 5", "tail -c 20000"] {
        bench.gmsh_that_writes("4.99", part);
        let told = told(bench.command("static", "out", &[]), 1);
        has(&told, "gmsh ended & disk full");
        assert_eq!(bench.entries(), Vec::<PathBuf>::new(), "{part}");
        assert!(!bench.0.join("out/mesh.msh").exists(), "{part}");
    }
    // What the script makes, whole as it is, is told as it is.
    let no_groups = "printf '$MeshFormat\\n4.1 0 8\\n$EndMeshFormat\\n$Entities\\n0 0 0 0\\n$EndEntities\\n\
                     $Nodes\\n0 0 0 0\\n$EndNodes\\n$Elements\\n0 0 0 0\\n$EndElements\\n%.0s'";
    bench.gmsh_that_writes("4.99", no_groups);
    let told = said(&ended(bench.command("static", "out", &[]), 2));
    assert!(!told.contains("disk"), "{told}");
    assert_eq!(bench.entries(), Vec::<PathBuf>::new());
    bench.gmsh("4.99");
    assert_eq!(bench.kept(&[]), [false, false]);
    assert_eq!(bench.kept(&[]), [true, true]);
}

/// An intact entry whose mesh cannot be read.
#[test]
fn a_kept_mesh_that_cannot_be_used_is_removed_and_made_anew_once() {
    let bench = Bench::new("unusable");
    ended(bench.command("run", "first", &[]), 0);
    let right = bench.files("first");
    assert_eq!(bench.meshed(), 1);
    let entry = bench.entry("mesh");
    let mut bytes = std::fs::read(&entry).unwrap();
    let section = b"$Elements";
    let at = bytes.windows(section.len()).position(|w| w == section);
    bytes[at.unwrap() + 1] = b'X';
    let hashed = bytes.len() - 32;
    let hash = blake3::hash(&bytes[..hashed]);
    bytes[hashed..].copy_from_slice(hash.as_bytes());
    std::fs::write(&entry, bytes).unwrap();
    let told = said(&ended(bench.command("run", "again", &[]), 0));
    let warnings = told.matches("is of no use").count();
    assert!(warnings == 1 && told.contains("$Xlements"), "{told}");
    assert_same(&bench.files("again"), &right);
    assert_eq!(bench.meshed(), 2);
    assert_eq!(bench.kept(&[]), [true, true]);
    assert_eq!(bench.meshed(), 2);
}

/// The cache is in a folder with files of the user, old and large ones, some with names like those
/// of the cache.
#[test]
fn files_of_others_stay() {
    let bench = Bench::new("others");
    let work = bench.0.join("work");
    let inside = work.join(ENTRIES);
    std::fs::create_dir_all(&work).unwrap();
    let put = |path: PathBuf| {
        let file = std::fs::File::create(&path).unwrap();
        file.set_len(3 << 20).unwrap();
        let day = std::time::Duration::from_secs(86400);
        file.set_modified(std::time::SystemTime::now() - day)
            .unwrap();
        path
    };
    let entry = format!("mesh-{}", "0".repeat(64));
    let mut others = vec![];
    for name in ["Cargo.lock", "film.mp4.part", "thesis.dat", &entry] {
        others.push(put(work.join(name)));
    }
    let run = |out: &str, young: &str| {
        let mut command = bench.command("static", out, &[young]);
        command.current_dir(&work).args(["--cache", "."]);
        command.args(["--cache-limit-gib", "1e-3"]);
        ended(command, 0)
    };
    let all_stay = |others: &[PathBuf]| {
        for other in others {
            assert!(other.exists(), "{} is gone", other.display());
        }
    };
    run("one", "body.0.young_pa=100e9");
    all_stay(&others);
    for name in ["Cargo.lock", "film.mp4.part", "thesis.dat"] {
        others.push(put(inside.join(name)));
    }
    let old = put(inside.join(&entry));
    run("two", "body.0.young_pa=101e9");
    all_stay(&others);
    assert!(!old.exists(), "an entry above the limit");
    // A folder of that name that is not marked is nobody's to clear, and none to write to.
    std::fs::remove_file(inside.join("CACHEDIR.TAG")).unwrap();
    let old = put(old);
    let before = std::fs::read_dir(&inside).unwrap().count();
    let told = said(&run("three", "body.0.young_pa=102e9"));
    assert!(told.contains("CACHEDIR.TAG"), "{told}");
    assert!(old.exists());
    assert_eq!(std::fs::read_dir(&inside).unwrap().count(), before);
}

#[test]
fn runs_side_by_side_share_a_folder() {
    let bench = Bench::new("race");
    let children = ["a", "b", "c"].map(|out| {
        let mut command = bench.command("run", out, &[]);
        (out, command.arg("--quiet").spawn().unwrap())
    });
    for (out, mut child) in children {
        assert!(child.wait().unwrap().success());
        assert_same(&bench.files(out), &bench.files("a"));
    }
    let names: Vec<String> = bench
        .entries()
        .iter()
        .map(|e| e.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    assert_eq!(names.len(), 3, "{names:?}");
    // One of them made what all needed, and no lock is left.
    assert_eq!(bench.meshed(), 1);
    let made = ["a", "b", "c"].map(|out| bench.stages(out));
    for stage in 0..2 {
        assert_eq!(
            made.iter().filter(|kept| !kept[stage]).count(),
            1,
            "{made:?}"
        );
    }
    assert!(bench.cache().join(ENTRIES).join("CACHEDIR.TAG").is_file());
    assert_eq!(std::fs::read_dir(bench.cache()).unwrap().count(), 1);
    assert_eq!(bench.kept(&[]), [true, true]);
}

#[test]
fn the_limit_holds_and_a_folder_that_cannot_be_written_is_a_warning() {
    let bench = Bench::new("limit");
    let with = |arguments: &[&str]| {
        let mut command = bench.command("static", "out", &[]);
        command.args(arguments);
        command
    };
    for off in [&["--no-cache"][..], &["--cache-limit-gib", "0"]] {
        ended(with(off), 0);
        assert!(!bench.cache().exists());
    }
    let sizes = || -> u64 {
        let entries = bench.entries();
        entries.iter().map(|e| e.metadata().unwrap().len()).sum()
    };
    ended(with(&[]), 0);
    assert_eq!(bench.entries().len(), 3);
    let all = sizes();
    // One byte too little for another model: what was used longest ago leaves.
    let limit = format!("{:e}", (all + 1000) as f64 / (1u64 << 30) as f64);
    let mut other = with(&["--set", "body.0.young_pa=90e9"]);
    ended(other.args(["--cache-limit-gib", &limit]), 0);
    assert!(sizes() <= all + 1000, "{} {all}", sizes());
    assert!(bench.entries().len() >= 2);
    let too_large = with(&["--cache-limit-gib", "1e-6", "--set", "body.0.young_pa=91e9"]);
    has(&told(too_large, 0), "limit of the cache");
    // A file where the folder should be.
    let taken = bench.0.join("gmsh");
    let no_folder = with(&["--cache", taken.to_str().unwrap()]);
    has(&told(no_folder, 0), "--no-cache");
    let mut wrong = with(&[]);
    wrong.env("DOVETAIL_CACHE_LIMIT_GIB", "much");
    has(&told(wrong, 2), "DOVETAIL_CACHE_LIMIT_GIB");
}

/// A study of two pressures and two coefficients of friction: one mesh, two reduced models, four
/// cases.
struct SharedPieces {
    bench: Bench,
    workflow: serde_json::Value,
}

impl SharedPieces {
    fn new(name: &str) -> Self {
        let bench = Bench::new(name);
        let text = format!(
            "name = \"shared\"\nscene = \"{}\"\nset = [\"body.*.fixed_interface_modes=0\"]\nmode = \"grid\"\n\
             [[parameter]]\nkey = \"load.0.pressure_pa\"\nvalues = [50e6, 60e6]\n\
             [[parameter]]\nkey = \"contact.0.friction\"\nvalues = [0.3, 0.01]\n",
            root().join(SCENE).display()
        );
        bench.0.write("study.toml", text);
        let mut pieces = Self {
            bench,
            workflow: serde_json::Value::Null,
        };
        pieces.workflow = pieces.exported("flow", &[]);
        pieces
    }

    /// The workflow that is exported into a folder.
    fn exported(&self, folder: &str, arguments: &[&str]) -> serde_json::Value {
        let flow = self.bench.0.join(folder);
        let mut export = self.study(&["--export-workflow", flow.to_str().unwrap()]);
        ended(export.args(arguments), 0);
        json(&flow.join("cases.json"))
    }

    /// Command of the workflow that makes this shared input.
    fn making(&self, piece: usize) -> Command {
        let words = &self.workflow["pieces"][piece]["command"];
        let words: Vec<&str> = (words.as_array().unwrap().iter())
            .map(|word| word.as_str().unwrap())
            .collect();
        self.bench.with_gmsh(program(root(), &words))
    }

    fn study(&self, arguments: &[&str]) -> Command {
        let mut program = self.bench.with_gmsh(program(root(), &["study"]));
        program
            .arg(self.bench.0.join("study.toml"))
            .arg("--out")
            .arg(self.bench.0.join("out"))
            .args(arguments);
        program
    }

    /// Command of a job, as the workflow runs it.
    fn job(&self, arguments: &[&str]) -> Command {
        let mut program = self.study(arguments);
        let own = self.workflow["arguments"].as_array().unwrap();
        program.args(own.iter().map(|a| a.as_str().unwrap()));
        program
    }

    fn jobs(&self, kind: &str) -> Vec<(String, Vec<String>)> {
        let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
        let job = |job: &serde_json::Value| {
            let needs = job["needs"].as_array().unwrap().iter().map(text);
            (text(&job["name"]), needs.collect())
        };
        self.workflow[kind]
            .as_array()
            .unwrap()
            .iter()
            .map(job)
            .collect()
    }
}

#[test]
fn what_cases_of_a_study_share_is_made_once() {
    let shared = SharedPieces::new("pieces");
    let named = |name: &str, needs: &[&str]| {
        (
            name.to_owned(),
            needs.iter().map(|n| (*n).to_owned()).collect(),
        )
    };
    let expected: [(String, Vec<String>); 3] = [
        named("mesh_1", &[]),
        named("reduction_1", &["mesh_1"]),
        named("reduction_2", &["mesh_1"]),
    ];
    assert_eq!(shared.jobs("pieces"), expected);
    let needs: Vec<String> = shared
        .jobs("cases")
        .into_iter()
        .flat_map(|(_, needs)| needs)
        .collect();
    assert_eq!(
        needs,
        ["reduction_1", "reduction_1", "reduction_2", "reduction_2"]
    );
    for piece in 0..expected.len() {
        ended(shared.making(piece), 0);
    }
    for (case, _) in shared.jobs("cases") {
        ended(shared.job(&["--case", &case]), 0);
        assert_eq!(
            shared.bench.stages(&format!("out/cases/{case}")),
            [true, true],
            "{case}"
        );
        // The modes with held flanks, which the study asks for, are there, too.
        let log = shared.bench.0.text(&format!("out/cases/{case}/log.txt"));
        let held = log.lines().find(|line| line.contains("flanks held"));
        assert!(held.is_some_and(|line| line.ends_with("cache")), "{log}");
    }
    assert_eq!(shared.bench.meshed(), 1);
    let entries = std::fs::read_dir(shared.bench.0.join("out/cache").join(ENTRIES)).unwrap();
    let mut kinds: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .filter_map(|name| Some(name.split_once('-')?.0.to_owned()))
        .collect();
    kinds.sort();
    let [held, recovery, reduced] = ["held_modes", "recovery", "reduced"].map(|kind| [kind; 2]);
    assert_eq!(kinds, [&held[..], &["mesh"], &recovery, &reduced].concat());
    // Costs are not compared here; where they are, or where it is said, each case makes all that it
    // needs.
    let alone = shared.exported("alone", &["--no-cache"]);
    assert_eq!(
        (alone["pieces"].clone(), alone["arguments"].clone()),
        (serde_json::json!([]), serde_json::json!(["--no-cache"]))
    );
}

#[test]
fn a_piece_that_cannot_be_made_leaves_the_cases_to_say_so() {
    let shared = SharedPieces::new("no_piece");
    shared.bench.gmsh_that_writes("4.99", "head -c 0");
    ended(shared.making(0), 1);
    let case = shared.job(&["--case", &shared.jobs("cases")[0].0]);
    has(&told(case, 3), "of 1 cases 1 have no result");
}
