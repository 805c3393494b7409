//! Warnings of bodies whose elements are not joined, and of nodes that lie at one place.

use crate::reporter::Reporter;
use dovetail_export::warning::Weight;
use dovetail_export::words::counted;
use dovetail_mesh::text::list;
use dovetail_mesh::{Group, Mesh};
use dovetail_solver::model::gather::name_for;
use dovetail_solver::model::{Assembly, BodySpec, MatrixSource};

/// Most pairs of nodes, and sizes of pieces, that a warning names.
const MOST_NAMED: usize = 3;

/// Warns of each body of several pieces, and of nodes of one body that lie at one place without
/// being joined by elements or by a contact.
pub(super) fn report(assembly: &Assembly, mesh: &Mesh, reporter: &Reporter<'_>) {
    let nodes = |body: &str, name: &str| {
        let group = mesh.groups.get(&*name_for(mesh, body, name));
        group.map_or(&[][..], |group| &group.nodes).to_vec()
    };
    let has_elements = |body: &&BodySpec| matches!(body.matrices, MatrixSource::Elements(_));
    for body in assembly.bodies.iter().filter(has_elements) {
        let volume = name_for(mesh, &body.name, &body.volume);
        let Some(volume) = mesh
            .groups
            .get(&*volume)
            .filter(|group| group.dimension == 3)
        else {
            continue; // an error where the model is made
        };
        let contacts = assembly.contacts.iter();
        let flanks = contacts.filter_map(|c| c.second.as_ref().map(|second| [&c.first, second]));
        let joined: Vec<Vec<u32>> = flanks
            .map(|flanks| {
                let mut both = flanks.map(|name| nodes(&body.name, name)).concat();
                both.sort_unstable();
                both
            })
            .collect();
        if let Some(text) = text(&body.name, mesh, volume, &joined) {
            reporter.warning(Weight::Doubt, text);
        }
    }
}

fn text(body: &str, mesh: &Mesh, volume: &Group, joined: &[Vec<u32>]) -> Option<String> {
    let mesh_pieces = mesh.pieces(volume, joined);
    let sizes: Vec<String> = mesh_pieces.elements.iter().map(usize::to_string).collect();
    let pieces = match sizes.len() {
        0 | 1 => None,
        count => Some(format!(
            "{count} pieces that share no node and no contact ({} elements)",
            short(&sizes)
        )),
    };
    let tag = |node: u32| mesh.node_tags[node as usize];
    let pairs = mesh_pieces.at_one_place.iter();
    let pairs: Vec<String> = pairs
        .map(|[a, b]| format!("{} and {}", tag(*a), tag(*b)))
        .collect();
    if pairs.is_empty() {
        return pieces.map(|pieces| {
            format!("body `{body}` consists of {pieces}: give each piece a body of its own, or join them in the mesh")
        });
    }
    let pieces = pieces.map_or(String::new(), |pieces| {
        format!(", which consists of {pieces}")
    });
    let counted = counted(pairs.len(), "pair of nodes is", "pairs of nodes are");
    Some(format!(
        "{counted} at one place in body `{body}`{pieces}, and the nodes of a pair move apart (first {}): if the body is whole there, merge them in the program that made the mesh (in Gmsh: `Coherence Mesh;`, in ParaView: Clean to Grid); if it is not, put a contact between surfaces there",
        short(&pairs)
    ))
}

/// The first few of a list, and the number of the others.
fn short(words: &[String]) -> String {
    match words.len().saturating_sub(MOST_NAMED) {
        0 => list(words),
        more => format!("{} and {more} more", list(&words[..MOST_NAMED])),
    }
}
