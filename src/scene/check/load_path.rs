//! Checks `[[static.path]]`.

use std::f64::consts::PI;

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable};
use crate::scene::entries::{RawPathPoint, RawScene};
use crate::scene::error::SceneFault;
use dovetail_solver::description::{LoadMultiples, PathPoint};

const SECTION: &str = "static.path";

/// Points that the steady load goes through.
pub fn load_path(checker: &mut Checker, raw: &RawScene) -> Option<Vec<PathPoint>> {
    let points = raw.static_state.as_ref().map(|table| &table.get_ref().path);
    let points = points.map_or(&[][..], Vec::as_slice);
    checker.items(
        SECTION,
        points,
        |_| &None,
        |checker, at, point| {
            let speed_rad_s = speed(checker, at, point, raw);
            let loads = loads(checker, at, point, raw);
            Some(PathPoint {
                speed_rad_s: speed_rad_s?,
                loads: loads?,
            })
        },
    )
}

/// Speed of a point, rad/s, which only what rotates has.
fn speed(
    checker: &mut Checker,
    at: &SceneTable,
    point: &RawPathPoint,
    raw: &RawScene,
) -> Option<Option<f64>> {
    let key = "speed_rpm";
    let rpm = checker.optional_number(at, key, &point.speed_rpm)?;
    if let Some(speed) = &point.speed_rpm
        && raw.rotation.is_none()
    {
        let remedy = if raw.reduced_model.is_some() {
            "a reduced model holds its steady load as a whole: give its multiple as `loads`, the square \
             of the ratio of speeds where rotation alone loads it"
        } else {
            "give a section [rotation] with an axis, where a speed_rpm of 0 is one at rest, or leave \
             `speed_rpm` out and give `loads`"
        };
        let fault = SceneFault::Lacks {
            path: at.key(key),
            needs: "[rotation]".to_owned(),
            remedy,
        };
        checker.fault(speed.span(), fault);
        return None;
    }
    if let (Some(speed), Some(body)) = (&point.speed_rpm, resting_matrix_body(raw)) {
        let fault = SceneFault::Exclusive {
            first: at.key(key),
            second: format!("body.{body}.stiffness_file"),
            remedy: "matrices of another program have no centrifugal load at a speed: leave the body out \
                     of `bodies` of [rotation], or leave `speed_rpm` out",
        };
        checker.fault(speed.span(), fault);
        return None;
    }
    Some(rpm.map(|rpm| rpm * 2.0 * PI / 60.0))
}

/// Name of a body with matrices of another program that rotates, where the speed of the scene is 0.
/// At other speeds such a body is refused whatever the path is.
fn resting_matrix_body(raw: &RawScene) -> Option<&str> {
    let rotation = raw.rotation.as_ref()?.get_ref();
    if rotation.speed_rpm.as_ref()?.get_ref().0 != 0.0 {
        return None;
    }
    let rotates = |name: &String| {
        let listed = rotation.bodies.as_ref().map(Spanned::get_ref);
        listed.is_none_or(|names| names.iter().any(|n| n.get_ref() == name))
    };
    let bodies = raw.body.iter().map(Spanned::get_ref);
    let with_matrices = bodies.filter(|body| body.stiffness_file.is_some());
    let names = with_matrices.filter_map(|body| Some(body.name.as_ref()?.get_ref()));
    names
        .into_iter()
        .find(|name| rotates(name))
        .map(String::as_str)
}

/// Multiples of the loads at a point.
fn loads(
    checker: &mut Checker,
    at: &SceneTable,
    point: &RawPathPoint,
    raw: &RawScene,
) -> Option<LoadMultiples> {
    let key = "loads";
    let (multiples, is_list) = checker.number_or_list(at, key, &point.loads)?;
    let Some(span) = point.loads.as_ref().map(Spanned::span) else {
        return Some(LoadMultiples::All(multiples[0]));
    };
    let count = raw.load.len();
    if raw.reduced_model.is_none() && count == 0 {
        let fault = SceneFault::Lacks {
            path: at.key(key),
            needs: "[[load]]".to_owned(),
            remedy: "the scene has no [[load]] that it could multiply: the load of a rotation follows \
                     `speed_rpm`, with its square",
        };
        checker.fault(span, fault);
        return None;
    }
    if !is_list {
        return Some(LoadMultiples::All(multiples[0]));
    }
    if raw.reduced_model.is_some() {
        let expected = "one number, as a reduced model holds its steady load as a whole";
        checker.wrong_type(at, key, span, format!("a list; expected {expected}"));
        return None;
    }
    if multiples.len() != count {
        let message = format!(
            "a list of {}; the scene has {count} [[load]]: expected one multiple for each, or one \
             number for all",
            multiples.len()
        );
        checker.wrong_type(at, key, span, message);
        return None;
    }
    Some(LoadMultiples::Each(multiples))
}
