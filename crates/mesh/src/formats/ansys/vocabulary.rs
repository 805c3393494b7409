//! Commands of Mechanical APDL: how a line is taken apart, and which commands are ignored without a
//! remark. A command is known by its first four letters, as in the program.

use std::borrow::Cow;

/// Settings of the solution, of files and of the display, sections and real constants of shells and
/// beams, and selections: they change no node and no solid element.
const SILENT: &str = "\
    ALLS ALPH ANTY AUTO BETA BFUN CECM CHEC CMPL CMSE CNTR CNVT CRPL CSCI CUTC DMPO DMPR DMPS DOF \
    EMUN EQSL ERES ESLN ESEL ETCO EXTO FINI FINISH IOPT IRLF KBC KSEL KUSE LNSR LSEL LUMP LVSC MODO \
    MONI MXPA NCNV NEQI NLDI NLGE NLHI NROP NSEL NSLE NSUB NUMO OUTR PRED PSTR QRDO R RCON REAL \
    RESC RESE RLBL RMOD RMOR SAVE SECB SECC SECD SECF SECN SECO SECT SHPP SOLC SOLV SSEL SSTI STEF \
    TBDA TBEO TBFI TBIN TBPT TBTE THOP TIME TIMI TINT TOFF TREF TRNO TSHA VSEL XMLO ASEL ESYS CSYS DSYS \
    WPAV WPCS FCUM BFCU SFCU PARR EOF ETLI MPLI NLIS ELIS MODC CMGR HARF BLKM";
/// Loads that an archive writes even where they are zero.
const MAYBE_ZERO: &str = "ACEL OMEG DOME CGLO CGOM DCGO CMOM CMDO";
/// Commands that make, move or remove nodes and elements by a rule.
const GENERATORS: &str = "\
    NGEN NSYM NSCA FILL QUAD NKPT NMOD NDEL NREA NUMM NUMC TRAN NORA MOVE \
    EGEN ENGE ESYM ENSY EDEL EREA ENOR EINT EREF \
    AMES LMES KMES VMES VSWE FVME AMAP IMES VEXT VOFF CDOP";

/// A command, in parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Command {
    /// Name as it is written, in capital letters.
    pub shown: String,
    /// Beginning of the name by which the command is known.
    pub key: String,
    /// Arguments without blanks around them.
    pub arguments: Vec<String>,
}

impl Command {
    /// Takes one command apart. `None` for an empty one.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let mut fields = text.split(',').map(str::trim);
        // `/com *****` and `TYPE 1` have a blank instead of the first comma.
        let name = fields.next()?;
        let (name, rest) = match name.split_once(char::is_whitespace) {
            Some((name, rest)) => (name, Some(rest.trim())),
            None => (name, None),
        };
        if name.is_empty() {
            return None;
        }
        let shown = name.to_ascii_uppercase();
        let slashed = shown.starts_with(['/', '*', '~']);
        let letters = if slashed { 5 } else { 4 };
        let arguments = rest.into_iter().chain(fields).map(str::to_owned);
        Some(Self {
            key: shown.chars().take(letters).collect(),
            arguments: arguments.collect(),
            shown,
        })
    }

    /// Argument number `i`, empty if it is missing.
    pub fn argument(&self, i: usize) -> &str {
        self.arguments.get(i).map_or("", String::as_str)
    }

    /// True if the command needs no remark.
    pub fn is_silent(&self) -> bool {
        let has = |list: &str| list.split_ascii_whitespace().any(|word| word == self.key);
        let zero = |argument: &String| argument.parse().is_ok_and(|number: f64| number == 0.0);
        self.shown.starts_with(['/', '*', '~', ':'])
            || has(SILENT)
            || has(MAYBE_ZERO) && self.arguments.iter().all(|a| a.is_empty() || zero(a))
    }

    /// True if the command makes, moves or removes nodes and elements.
    pub fn is_generator(&self) -> bool {
        GENERATORS
            .split_ascii_whitespace()
            .any(|word| word == self.key)
    }
}

/// Commands of a line, without its comment. A `$` separates them.
pub(super) fn commands(line: &str) -> Vec<&str> {
    let line = line.trim();
    if line.starts_with('/') || line.starts_with('*') {
        return vec![without_comment(line)];
    }
    split_outside_quotes(without_comment(line), '$')
}

fn without_comment(line: &str) -> &str {
    split_outside_quotes(line, '!')
        .first()
        .copied()
        .unwrap_or(line)
}

fn split_outside_quotes(line: &str, at: char) -> Vec<&str> {
    let mut quoted = false;
    let parts = line.split(move |c: char| {
        quoted ^= c == '\'';
        c == at && !quoted
    });
    parts.collect()
}

/// Name and value of `name = value`, or of `*SET,name,value`.
pub(super) fn assignment(text: &str) -> Option<(String, Cow<'_, str>)> {
    if let Some(command) = Command::parse(text).filter(|command| command.key == "*SET") {
        let value = command.argument(1).to_owned();
        return Some((command.argument(0).to_ascii_uppercase(), value.into()));
    }
    let (name, value) = text.split_once('=')?;
    let name = name.trim();
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let begins = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    let name = name.split('(').next().unwrap_or_default();
    let is_parameter = begins && name.chars().all(is_name);
    is_parameter.then(|| (name.to_ascii_uppercase(), value.trim().into()))
}

/// Text between the first two quotation marks.
pub(super) fn quoted(text: &str) -> Option<&str> {
    let (_, rest) = text.split_once('"')?;
    let (inner, _) = rest.split_once('"')?;
    Some(inner.trim()).filter(|inner| !inner.is_empty())
}
