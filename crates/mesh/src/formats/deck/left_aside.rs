//! Contents of a deck that are not read, or not as they are written, and the remarks on them.

use crate::text;

/// Names of such contents, most with their places in the form of a message.
#[derive(Debug, Default)]
pub(super) struct LeftAside {
    /// Places of lines that follow no keyword.
    pub without_keyword: Vec<String>,
    /// Types of elements that have no shape.
    pub types: Vec<String>,
    /// Keywords that are not read.
    pub keywords: Vec<String>,
    /// Parameters without a meaning here.
    pub parameters: Vec<String>,
    /// Parameters that their keywords do not have.
    pub unknown_parameters: Vec<String>,
    /// Ends of parts, instances and assemblies that have not begun.
    pub without_begin: Vec<String>,
    /// Properties that materials have more than once.
    pub given_again: Vec<String>,
    /// Materials with values for several temperatures.
    pub of_temperature: Vec<String>,
    /// Nodes that are defined again elsewhere.
    pub moved_nodes: Vec<String>,
    /// Elements with more nodes than their type has.
    pub surplus: Vec<String>,
}

impl LeftAside {
    /// Remarks, one sentence or two each.
    pub fn sentences(&self) -> impl Iterator<Item = String> {
        let remarks = [
            (
                "These lines follow no keyword and were not read",
                &self.without_keyword,
                String::new(),
            ),
            (
                "Elements of these types were left aside",
                &self.types,
                String::new(),
            ),
            (
                "These keywords were not read",
                &self.keywords,
                self.scene_hint(),
            ),
            (
                "These parameters were not read",
                &self.parameters,
                String::new(),
            ),
            (
                "These parameters were not read, because their keywords do not have them",
                &self.unknown_parameters,
                " Correct those that are misspelt.".to_owned(),
            ),
            (
                "These keywords end a part, an instance or an assembly that has not begun",
                &self.without_begin,
                String::new(),
            ),
            (
                "These properties are given more than once, and the last counts",
                &self.given_again,
                String::new(),
            ),
            (
                "Materials with values for several temperatures are taken at the first of each",
                &self.of_temperature,
                String::new(),
            ),
            (
                "These nodes are defined again at another place, and their last place counts",
                &self.moved_nodes,
                String::new(),
            ),
            (
                "These elements have more nodes than their type, and only the first ones count",
                &self.surplus,
                " Correct the type if it is wrong.".to_owned(),
            ),
        ];
        remarks
            .into_iter()
            .filter(|(_, list, _)| !list.is_empty())
            .map(|(sentence, list, hint)| format!("{sentence}: {}.{hint}", text::list(list)))
    }

    /// Hint at the keys of a scene that replace keywords.
    fn scene_hint(&self) -> String {
        const OF_THE_SCENE: [&str; 5] = ["*BOUNDARY", "*CONTACT PAIR", "*DLOAD", "*CLOAD", "*STEP"];
        let has = |word: &str| self.keywords.iter().any(|keyword| keyword == word);
        let mut hint = String::new();
        if OF_THE_SCENE.into_iter().any(has) {
            hint += " What holds, touches and loads the bodies stands in the scene.";
        }
        if has("*TIE") {
            hint += " What *TIE joins is joined in the scene by a contact with the law `bonded`.";
        }
        hint
    }
}
