//! Ends of the input that cannot be computed: the message says why not and what to do. Those that
//! can be: crates/solver/tests/library/extremes.rs.

use crate::shared_folder::Folder;
use crate::shared_program::{cases, has, scene_command, told};
use dovetail_testkit::folder::root;

#[test]
fn what_cannot_be_computed_says_why_and_what_to_do() {
    let folder = Folder::new("extremes");
    let scene = format!(
        "name = \"extreme\"\n[reduced_model]\nfolder = \"{}/tests/data/dovetail72\"\n\
         friction = 0.3\nforce_n = 1.0\n[damping]\nratio = 0.001\n\
         [response]\ntimes_first_linear_mode = [1.0, 1.0]\npoints = 1\nharmonics = 1\n",
        root().display()
    );
    let scene = folder.write("extreme.toml", scene);
    let table = "
        damping.ratio=0 => stuck mode 1 & no damping & damping.ratio = 0.001
        response.harmonics=0 => response.harmonics & dovetail static
        ";
    for [set, words] in cases(table) {
        let told = told(
            scene_command("run", &scene, &folder.join("out"), &[&set]),
            2,
        );
        has(&told, &words);
    }
}
