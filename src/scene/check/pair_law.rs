//! Law of a pair as keys of a scene, read and written.

use super::fields::{Checker, SceneTable};
use crate::scene::raw::{Located, Number};
use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;

/// Keys of a section that give the law of its pairs.
pub struct LawKeys<'a> {
    pub friction: &'a Located<Number>,
    pub gap_m: &'a Located<Number>,
    pub wear_m2_n: &'a Located<Number>,
    /// Normal and tangential springs, with their names.
    pub springs: [(&'static str, &'a Located<Number>); 2],
}

/// [`LawKeys`] of a table whose springs have these names.
macro_rules! law_keys {
    ($table:expr; $normal:ident, $tangential:ident) => {
        $crate::scene::check::pair_law::LawKeys {
            friction: &$table.friction,
            gap_m: &$table.gap_m,
            wear_m2_n: &$table.wear_m2_n,
            springs: [
                (stringify!($normal), &$table.$normal),
                (stringify!($tangential), &$table.$tangential),
            ],
        }
    };
}
pub(super) use law_keys;

impl LawKeys<'_> {
    /// Checks the law. Pairs that are bonded do not require a coefficient of friction.
    pub fn law(self, checker: &mut Checker, at: &SceneTable, bonded: bool) -> Option<PairLaw> {
        let friction = match self.friction {
            None if bonded => Some(0.0),
            given => checker.number(at, "friction", given),
        };
        let gap_m = checker.number(at, "gap_m", self.gap_m);
        let stiffness = stiffness(checker, at, self.springs);
        let wear_m2_n = checker.number(at, "wear_m2_n", self.wear_m2_n);
        Some(PairLaw {
            friction: friction?,
            gap_m: gap_m?,
            stiffness: stiffness?,
            wear_m2_n: wear_m2_n?,
        })
    }
}

/// Normal and tangential springs; `Some(None)` if the contact is rigid.
fn stiffness(
    checker: &mut Checker,
    at: &SceneTable,
    springs: [(&'static str, &Located<Number>); 2],
) -> Option<Option<PairStiffness>> {
    let [normal, tangential] = springs.map(|(key, given)| {
        let number = |_| checker.number(at, key, given);
        given.as_ref().map(number)
    });
    let mut lacks = |given: usize| {
        let [(key, place), (other, _)] = [springs[given], springs[1 - given]];
        let remedy = "give both, or leave both out: rigid contact";
        checker.note_missing_partner(at, key, other, place.as_ref()?.span(), remedy);
        None
    };
    match (normal, tangential) {
        (None, None) => Some(None),
        (Some(normal), Some(tangential)) => Some(Some(PairStiffness::new(normal?, tangential?))),
        (Some(_), None) => lacks(0),
        (None, Some(_)) => lacks(1),
    }
}

/// Lines of `[reduced_model]` that give this law to its pairs.
pub fn reduced_model_lines(law: PairLaw) -> String {
    // All fields, so that none is left out.
    let PairLaw {
        friction,
        gap_m,
        stiffness,
        wear_m2_n,
    } = law;
    let springs = stiffness.map(|springs| {
        format!(
            "normal_stiffness_n_m = {:?}\ntangential_stiffness_n_m = {:?}\n",
            springs.normal_n_m, springs.tangential_n_m
        )
    });
    let springs = springs.unwrap_or_default();
    let wear = match wear_m2_n {
        0.0 => String::new(),
        _ => format!("wear_m2_n = {wear_m2_n:?}\n"),
    };
    format!("friction = {friction:?}\n{springs}gap_m = {gap_m:?}\n{wear}")
}
