//! A blade in its jaw as a scene, run by the program itself.

use dovetail_mesh::Mesh;

use super::NEWTON;
use super::meshes::write;
use crate::shared_folder::Folder;
use crate::shared_program::{ended, scene_command};
use crate::shared_runs::{Row, number, rows, summary};

#[derive(Clone)]
pub struct Joint {
    pub mesh: Mesh,
    pub metres_per_unit: f64,
    pub young_pa: f64,
    pub speed_rpm: f64,
    pub axis: [f64; 3],
    pub prestress: &'static str,
    /// Direction of force and observation.
    pub direction: [f64; 3],
    pub force_n: f64,
    pub jaw_first: bool,
    pub threads: Option<&'static str>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    pub response_csv: String,
    pub points: Vec<Point>,
    /// Normal force of each contact in the static state, N.
    pub static_normal_n: Vec<f64>,
    pub largest_slip_m: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    pub frequency_hz: f64,
    pub amplitude_m: f64,
    pub stuck_amplitude_m: f64,
    pub friction_power_w: f64,
    pub input_power_w: f64,
    pub slipping_pairs: usize,
    pub opening_pairs: usize,
}

impl Joint {
    pub fn new(mesh: Mesh) -> Self {
        Self {
            mesh,
            metres_per_unit: 1e-3,
            young_pa: 113.8e9,
            speed_rpm: 5000.0,
            axis: [1.0, 0.0, 0.0],
            prestress: "held_flanks",
            direction: [0.0, 1.0, 0.0],
            force_n: 2.0,
            jaw_first: false,
            threads: None,
        }
    }

    fn scene(&self) -> String {
        let Self {
            metres_per_unit,
            young_pa,
            speed_rpm,
            axis,
            prestress,
            direction,
            force_n,
            ..
        } = self;
        let body = |name: &str, fixed: &str| {
            format!(
                "[[body]]\nname = \"{name}\"\nvolume = \"{name}\"\nyoung_pa = {young_pa:?}\npoisson = 0.34\n\
                 density_kg_m3 = 4430\nfixed = [{fixed}]\nfixed_interface_modes = 5\n"
            )
        };
        let (blade, jaw) = (body("blade", ""), body("jaw", "\"jaw_base\""));
        let (bodies, [first, second]) = if self.jaw_first {
            (jaw + &blade, ["jaw", "blade"])
        } else {
            (blade + &jaw, ["blade", "jaw"])
        };
        let contact = |side: &str| {
            format!(
                "[[contact]]\nname = \"{side}\"\nfirst = \"{first}_flank_{side}\"\n\
                 second = \"{second}_flank_{side}\"\nfriction = 0.3\n"
            )
        };
        format!(
            "name = \"joint\"\n\
             [mesh]\nfile = \"joint.msh\"\nmetres_per_unit = {metres_per_unit:?}\n\
             {bodies}\
             [rotation]\naxis = {axis:?}\nspeed_rpm = {speed_rpm:?}\nprestress = \"{prestress}\"\n\
             {}{}\
             [damping]\nratio = 0.001\n\
             [[excitation]]\non = \"excitation\"\ndirection = {direction:?}\nforce_n = {force_n:?}\n\
             [[observe]]\nname = \"tip\"\npoints = \"tip_trailing_edge\"\ndirection = {direction:?}\n\
             [response]\ntimes_first_linear_mode = [0.99, 1.01]\npoints = 3\nharmonics = 2\n\
             tolerance = {NEWTON:e}\n",
            contact("left"),
            contact("right"),
        )
    }

    /// Runs the scene in a folder of this name, which is removed at the end.
    pub fn run(&self, name: &str) -> Run {
        let folder = Folder::new(name);
        folder.write("joint.msh", write(&self.mesh));
        let scene = folder.write("joint.toml", self.scene());
        let mut run = scene_command("run", scene, &folder, &[]);
        let threads = self.threads.iter();
        ended(run.args(threads.flat_map(|n| ["--threads", n])), 0);
        read(&folder)
    }
}

fn read(folder: &Folder) -> Run {
    let point = |row: &Row| {
        assert_eq!(row["outcome"], "converged");
        Point {
            frequency_hz: number(row, "frequency_hz"),
            amplitude_m: number(row, "tip_amplitude_m"),
            stuck_amplitude_m: number(row, "tip_linear_amplitude_m"),
            friction_power_w: number(row, "friction_power_w"),
            input_power_w: number(row, "input_power_w"),
            slipping_pairs: row["slipping_pairs"].parse().unwrap(),
            opening_pairs: row["opening_pairs"].parse().unwrap(),
        }
    };
    let state = &summary(folder)["static"];
    let contacts = state["contacts"].as_array().unwrap().iter();
    Run {
        points: rows(&folder.join("response.csv"))
            .iter()
            .map(point)
            .collect(),
        static_normal_n: contacts
            .map(|c| c["normal_force_n"].as_f64().unwrap())
            .collect(),
        largest_slip_m: state["largest_slip_m"].as_f64().unwrap(),
        response_csv: folder.text("response.csv"),
    }
}
