//! Known keywords and parameters, and the words that their beginnings abbreviate.
//!
//! Abaqus accepts the beginning of a keyword, of a parameter or of a parameter's value for the
//! whole word, where no other word of that place begins so. All words are given here in capital
//! letters without blanks, in lists with blanks between them.

use std::str::SplitAsciiWhitespace;

use super::lines::{Keyword, fields, normalised_name};
use crate::MeshError;
use crate::text;

/// Keyword that is read, with the parameters that it may have, between blanks.
struct Entry {
    keyword: &'static str,
    /// Parameters that are read, or that change nothing of what is read.
    read: &'static str,
    /// Parameters of Abaqus or CalculiX that are ignored.
    aside: &'static str,
}

const fn entry(keyword: &'static str, read: &'static str, aside: &'static str) -> Entry {
    Entry {
        keyword,
        read,
        aside,
    }
}

const READ: [Entry; 16] = [
    entry("NODE", "INPUT NSET SYSTEM", ""),
    entry(
        "ELEMENT",
        "ELSET INPUT PARENT TYPE",
        "DLOAD FILE OFFSET SOLIDELEMENTNUMBERING",
    ),
    entry("NSET", "ELSET GENERATE INSTANCE INTERNAL NSET UNSORTED", ""),
    entry("ELSET", "ELSET GENERATE INSTANCE INTERNAL UNSORTED", ""),
    entry(
        "SURFACE",
        "COMBINE CROP INTERNAL NAME TYPE",
        "DEFINITION FILLETRADIUS MAXRATIO NOOFFSET NOTHICK PROPERTY REGIONTYPE SCALETHICK TRIM",
    ),
    entry(
        "SOLIDSECTION",
        "ELSET MATERIAL",
        "COMPOSITE CONTROLS LAYUP NODALTHICKNESS OFFSET ORDER ORIENTATION REFNODE STACKDIRECTION \
         SYMMETRIC THICKNESS",
    ),
    entry(
        "MATERIAL",
        "NAME",
        "RTOL SRATEFACTOR SRATETYPE STRAINRATEREGULARIZATION",
    ),
    entry("ELASTIC", "TYPE", "COMPRESSIONFACTOR DEPENDENCIES MODULI"),
    entry("DENSITY", "POREFLUID", "DEPENDENCIES"),
    entry("INCLUDE", "INPUT", "PASSWORD"),
    entry("PART", "NAME", ""),
    entry("ENDPART", "", "NAME"),
    entry("ASSEMBLY", "NAME", ""),
    entry("ENDASSEMBLY", "", "NAME"),
    entry("INSTANCE", "NAME PART", "INSTANCE LIBRARY"),
    entry("ENDINSTANCE", "", "NAME"),
];
/// Keywords that make nodes or elements by a rule.
const GENERATORS: &str = "\
    NGEN NFILL NCOPY NMAP ELGEN ELCOPY SYSTEM PARAMETER IMPORT SYMMETRICMODELGENERATION";
/// Other keywords whose first three letters are those of one above. They determine which beginnings
/// abbreviate only one word.
const OTHERS: &str = "\
    NODALENERGYRATE NODALTHICKNESS NODEFILE NODEOUTPUT NODEPRINT NODERESPONSE \
    ELEMENTMATRIXOUTPUT ELEMENTOPERATOROUTPUT ELEMENTOUTPUT ELEMENTPROGRESSIVEACTIVATION \
    ELEMENTRECOVERYMATRIX ELEMENTRESPONSE ELECTRICALCONDUCTIVITY ELECTROMAGNETIC SURFACEBEHAVIOR \
    SURFACEFLAW SURFACEINTERACTION SURFACEPROPERTY SURFACEPROPERTYASSIGNMENT SURFACESECTION \
    SURFACESMOOTHING SOLUBILITY SOLUTIONTECHNIQUE MATRIX MATRIXASSEMBLE MATRIXCHECK \
    MATRIXGENERATE MATRIXINPUT MATRIXOUTPUT INCIDENTWAVE INCIDENTWAVEFLUIDPROPERTY \
    INCIDENTWAVEINTERACTION INCIDENTWAVEINTERACTIONPROPERTY INCIDENTWAVEPROPERTY \
    INCIDENTWAVEREFLECTION INCREMENTATIONOUTPUT PARAMETERDEPENDENCE PARAMETERSHAPEVARIATION \
    PARTICLEGENERATOR PARTICLEGENERATORFLOW PARTICLEGENERATORINLET PARTICLEGENERATORMIXTURE \
    PARTICLEOUTPUT END ENDLOADCASE ENDSTEP SUBCYCLING SUBMODEL SUBSTRUCTURECOPY SUBSTRUCTUREDELETE \
    SUBSTRUCTUREDIRECTORY SUBSTRUCTUREGENERATE SUBSTRUCTURELOADCASE SUBSTRUCTUREMATRIXOUTPUT \
    SUBSTRUCTUREPATH SUBSTRUCTUREPROPERTY SYMMETRICRESULTSTRANSFER IMPEDANCE IMPEDANCEPROPERTY \
    IMPERFECTION IMPORTCONTROLS";
/// Fewest letters by which a keyword can be completed.
const SHORTEST: usize = 3;

/// Keyword line after interpretation.
pub(super) struct Understood {
    /// Keyword with its name and parameters completed.
    pub keyword: Keyword,
    pub is_generator: bool,
    /// Parameters that are ignored, as they are written.
    pub aside: Vec<String>,
    /// Parameters that the keyword does not have, which CalculiX skips.
    pub unknown: Vec<String>,
}

/// Completes the name and the parameters of a keyword line. A keyword that is not read stays as it
/// is.
///
/// # Errors
/// A beginning of several words.
pub(super) fn understand(mut keyword: Keyword) -> Result<Understood, MeshError> {
    let generators = || words(GENERATORS);
    let ours = || READ.iter().map(|entry| entry.keyword).chain(generators());
    let is_other = words(OTHERS).any(|word| word == keyword.name);
    let begins = |word: &str| word.starts_with(&keyword.name);
    if ours().any(begins) && !is_other && !keyword.name.is_empty() {
        keyword.name = match complete(&keyword.name, ours().chain(words(OTHERS))) {
            Ok(word) if word == keyword.name || keyword.name.len() >= SHORTEST => word.to_owned(),
            Ok(word) => return Err(ambiguous(&keyword.shown, &[word])),
            Err(words) => return Err(ambiguous(&keyword.shown, &words)),
        };
    }
    let (mut aside, mut unknown) = (Vec::new(), Vec::new());
    if let Some(entry) = READ.iter().find(|entry| entry.keyword == keyword.name) {
        for (parameter, _) in &mut keyword.parameters {
            let words_of_entry = || words(entry.read).chain(words(entry.aside));
            match complete(parameter, words_of_entry()) {
                Ok(word) => {
                    if words(entry.aside).any(|ignored| ignored == word) {
                        aside.push(parameter.clone());
                    }
                    *parameter = word.to_owned();
                }
                Err(several) if !several.is_empty() => {
                    return Err(ambiguous(parameter, &several));
                }
                Err(_) => unknown.push(parameter.clone()),
            }
        }
    }
    Ok(Understood {
        is_generator: generators().any(|word| word == keyword.name),
        keyword,
        aside,
        unknown,
    })
}

/// Returns `true` if `more` continues a keyword line: all of its fields are parameters of the
/// keyword.
pub(super) fn continues(line: &str, more: &str) -> bool {
    let name = normalised_name(fields(line).next().unwrap_or_default());
    let name = name.trim_start_matches('*');
    let entry = READ.iter().find(|entry| entry.keyword.starts_with(name));
    let is_word = |field: &str| match entry {
        Some(entry) => words(entry.read)
            .chain(words(entry.aside))
            .any(|word| field.len() >= SHORTEST && word.starts_with(field)),
        None => true,
    };
    let is_parameter = |field: &str| field.contains('=') || is_word(&normalised_name(field));
    !more.starts_with('*') && fields(more).filter(|f| !f.is_empty()).all(is_parameter)
}

/// Words between the blanks of a list.
pub(super) fn words(list: &'static str) -> SplitAsciiWhitespace<'static> {
    list.split_ascii_whitespace()
}

/// Value of a parameter: the one of the words of `list` that it is, or begins; otherwise as it is
/// written, in capital letters.
///
/// # Errors
/// It begins several of them.
pub(super) fn value(found: &str, list: &'static str) -> Result<String, MeshError> {
    let name = normalised_name(found);
    match complete(&name, words(list)) {
        Ok(word) => Ok(word.to_owned()),
        Err(several) if several.is_empty() => Ok(name),
        Err(several) => Err(ambiguous(&name, &several)),
    }
}

/// Word that this is, or alone begins; otherwise all words that begin so.
fn complete(
    beginning: &str,
    words: impl Iterator<Item = &'static str> + Clone,
) -> Result<&'static str, Vec<&'static str>> {
    if let Some(whole) = words.clone().find(|word| *word == beginning) {
        return Ok(whole);
    }
    let matches: Vec<_> = words.filter(|word| word.starts_with(beginning)).collect();
    match matches[..] {
        [one] => Ok(one),
        _ => Err(matches),
    }
}

fn ambiguous(found: &str, words: &[&str]) -> MeshError {
    MeshError::CutShort {
        found: found.to_owned(),
        words: text::list(words),
    }
}
