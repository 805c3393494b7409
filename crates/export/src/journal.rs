//! Journal of a run: every solved frequency is on disk before the next one is solved.
//!
//! The file begins with a mark. A record follows for each frequency: the length of its content, a
//! hash of the content, and the content. The content is the hash of the inputs of the response and
//! the solved frequency, exact to the bit. A record that was being written when the run ended is
//! dropped.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::ExportError;
use dovetail_solver::dlft::SolvedFrequency;
use dovetail_superelement::input;

/// Name of the journal in the folder of a run, where it remains until the run ends.
pub const JOURNAL: &str = "response.journal";

/// Name of the journal of `dovetail peaks`, whose frequencies are those of peaks.
pub const PEAKS_JOURNAL: &str = "peaks.journal";
/// Name of the journal of `dovetail curve`.
pub const CURVE_JOURNAL: &str = "curve.journal";
/// File name of the vibrations that `dovetail wear` has found so far.
pub const WEAR_JOURNAL: &str = "wear.journal";

const MARK: &[u8; 18] = b"dovetail journal 4";
const HASH: usize = 32;

/// Hash of all inputs of a response.
pub type Inputs = [u8; HASH];

/// Open journal of a folder, which belongs to the process that has the folder
/// ([`super::lock::FolderLock`]).
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Recorded frequencies: inputs, number of the frequency, and whether it is that of the second
    /// attempt.
    known: HashSet<(Inputs, (usize, bool))>,
}

impl Journal {
    /// Opens the journal, or creates an empty one.
    ///
    /// # Errors
    /// A file that cannot be read or written, or that is not a journal.
    pub fn open(path: &Path) -> Result<Self, ExportError> {
        let failed = failed(path);
        let mut options = File::options();
        let options = options.read(true).write(true).create(true).truncate(false);
        if path.exists() {
            input::check(path).map_err(&failed)?;
        }
        let file = options.open(path).map_err(&failed)?;
        let mut journal = Self {
            path: path.to_path_buf(),
            file,
            known: HashSet::new(),
        };
        let mut mark = Vec::new();
        let start = (&journal.file).take(MARK.len() as u64);
        BufReader::new(start)
            .read_to_end(&mut mark)
            .map_err(&failed)?;
        if mark.len() < MARK.len() && MARK.starts_with(&mark) {
            journal.clear()?;
        } else if mark != MARK {
            let why = io::Error::new(io::ErrorKind::InvalidData, "it is no journal of a run");
            return Err(failed(why));
        } else {
            journal.read(|_, _| ())?;
        }
        Ok(journal)
    }

    /// Number of recorded frequencies.
    pub fn count(&self) -> usize {
        self.known.len()
    }

    /// Returns `true` if the journal has no frequency.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// Removes all records.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn clear(&mut self) -> Result<(), ExportError> {
        self.known.clear();
        let begin = || {
            self.file.set_len(0)?;
            (&self.file).seek(SeekFrom::Start(0))?;
            (&self.file).write_all(MARK)
        };
        begin().map_err(failed(&self.path))
    }

    /// Recorded frequencies of a response with these inputs.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn solved(&mut self, inputs: &Inputs) -> Result<Vec<SolvedFrequency>, ExportError> {
        let mut records = Vec::new();
        if !self.known.iter().any(|(of, _)| of == inputs) {
            return Ok(records);
        }
        self.read(|of, solved| {
            if of == inputs {
                records.push(solved);
            }
        })?;
        Ok(records)
    }

    /// Adds a frequency unless it is already recorded.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn append(&mut self, inputs: &Inputs, solved: &SolvedFrequency) -> Result<(), ExportError> {
        let key = (*inputs, solved.place());
        if self.known.contains(&key) {
            return Ok(());
        }
        let mut record = vec![0; 8 + HASH];
        record.extend_from_slice(inputs);
        let write = || {
            let record = postcard::to_extend(solved, record).map_err(io::Error::other)?;
            (&self.file).write_all(&sealed(record))
        };
        write().map_err(failed(&self.path))?;
        self.known.insert(key);
        Ok(())
    }

    /// Waits until the added records are on disk.
    ///
    /// # Errors
    /// A failed synchronisation with the disk.
    pub fn sync(&self) -> Result<(), ExportError> {
        self.file.sync_data().map_err(failed(&self.path))
    }

    /// Removes the file, if it is still there.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn remove(&self) -> Result<(), ExportError> {
        match fs::remove_file(&self.path) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                let path = self.path.clone();
                Err(ExportError::RemoveOld { path, source })
            }
            _ => Ok(()),
        }
    }

    /// Removes the file if it has no frequency from which to continue.
    ///
    /// # Errors
    /// Those of [`Journal::remove`].
    pub fn remove_if_empty(&self) -> Result<(), ExportError> {
        match self.is_empty() {
            true => self.remove(),
            false => Ok(()),
        }
    }

    /// Reads all records, drops everything after the last intact one, and stays at the end.
    fn read(&mut self, mut each: impl FnMut(&Inputs, SolvedFrequency)) -> Result<(), ExportError> {
        let known = &mut self.known;
        known.clear();
        let mut through = || {
            let length = self.file.metadata()?.len();
            let mut sound = MARK.len() as u64;
            (&self.file).seek(SeekFrom::Start(sound))?;
            let mut reader = BufReader::with_capacity(1 << 20, &self.file);
            while let Some((inputs, solved, size)) = next(&mut reader, length - sound)? {
                sound += size;
                known.insert((inputs, solved.place()));
                each(&inputs, solved);
            }
            if sound < length {
                self.file.set_len(sound)?;
            }
            (&self.file).seek(SeekFrom::Start(sound)).map(|_| ())
        };
        through().map_err(failed(&self.path))
    }
}

/// A record with its length and hash filled in.
fn sealed(mut record: Vec<u8>) -> Vec<u8> {
    let (head, content) = record.split_at_mut(8 + HASH);
    head[..8].copy_from_slice(&(content.len() as u64).to_le_bytes());
    head[8..].copy_from_slice(blake3::hash(content).as_bytes());
    record
}

/// Next record and its size on disk; `None` if the `left` bytes do not begin with an intact record.
fn next(reader: &mut impl Read, left: u64) -> io::Result<Option<(Inputs, SolvedFrequency, u64)>> {
    const HEAD: u64 = 8 + HASH as u64;
    if left < HEAD {
        return Ok(None);
    }
    let (mut length, mut hash) = ([0; 8], [0; HASH]);
    reader.read_exact(&mut length)?;
    reader.read_exact(&mut hash)?;
    let length = u64::from_le_bytes(length);
    if length > left - HEAD {
        return Ok(None);
    }
    let mut content = vec![0; length as usize];
    reader.read_exact(&mut content)?;
    if *blake3::hash(&content).as_bytes() != hash {
        return Ok(None);
    }
    let parts = content.split_first_chunk::<HASH>();
    let read =
        |(inputs, solved): (&Inputs, &[u8])| Some((*inputs, postcard::from_bytes(solved).ok()?));
    let record = parts.and_then(read);
    Ok(record.map(|(inputs, solved)| (inputs, solved, HEAD + length)))
}

fn failed(path: &Path) -> impl Fn(io::Error) -> ExportError {
    move |source| ExportError::Journal {
        path: path.to_path_buf(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_solver::dlft::retention::Mean;
    use dovetail_solver::dlft::{LinearPoint, Orbit, Outcome};

    const INPUTS: Inputs = [7; HASH];

    fn solved(frequency_hz: f64) -> SolvedFrequency {
        let orbit = Orbit {
            point: frequency_hz as usize,
            x: vec![0.1 * frequency_hz; 9],
            lambda: vec![-1.0 / 3.0; 9],
            modal: vec![1e-300; 3],
            observed: vec![vec![0.0, -0.0, 2.0]],
            observed_amplitude: vec![2.0],
            newton_iterations: 3,
            krylov_iterations: 4,
            residual: f64::INFINITY,
            mean: Mean::Retained,
            ..Orbit::motionless(frequency_hz, Outcome::Stagnated)
        };
        let linear = LinearPoint {
            frequency_hz,
            observed_amplitude: vec![1.0],
        };
        SolvedFrequency {
            orbit,
            linear,
            next_level: 2,
            again: false,
            along: None,
        }
    }

    fn text(solved: &[SolvedFrequency]) -> String {
        format!("{solved:?}")
    }

    /// Bytes of a journal with these frequencies.
    fn bytes(path: &Path, frequencies_hz: &[f64]) -> Vec<u8> {
        let mut journal = Journal::open(path).unwrap();
        for f in frequencies_hz {
            journal.append(&INPUTS, &solved(*f)).unwrap();
        }
        fs::read(path).unwrap()
    }

    #[test]
    fn what_is_added_is_read_to_the_bit_and_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        bytes(&path, &[451.0, 450.0, 451.0]);
        let mut journal = Journal::open(&path).unwrap();
        journal.append(&INPUTS, &solved(450.0)).unwrap();
        journal.append(&[8; HASH], &solved(450.0)).unwrap();
        let found = journal.solved(&INPUTS).unwrap();
        assert_eq!(text(&found), text(&[solved(451.0), solved(450.0)]));
        // After reading it goes on at the end.
        journal.append(&INPUTS, &solved(452.0)).unwrap();
        assert_eq!(journal.solved(&INPUTS).unwrap().len(), 3);
        assert_eq!(journal.solved(&[8; HASH]).unwrap().len(), 1);
        assert!(!journal.is_empty());
        journal.clear().unwrap();
        assert!(journal.is_empty() && journal.solved(&INPUTS).unwrap().is_empty());
        journal.append(&INPUTS, &solved(450.0)).unwrap();
        assert_eq!(journal.solved(&INPUTS).unwrap().len(), 1);
        journal.remove().unwrap();
        assert!(!path.exists());
    }

    #[test]
    fn of_a_journal_that_is_cut_or_damaged_the_records_before_serve() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let one = bytes(&path, &[450.0]).len();
        let whole = bytes(&path, &[450.0, 451.0]);
        let sound = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            let mut journal = Journal::open(&path)?;
            // It can be added to, and what is added is found behind the sound ones.
            journal.append(&INPUTS, &solved(452.0))?;
            drop(journal);
            let found = Journal::open(&path)?.solved(&INPUTS)?;
            assert_eq!(text(&found[found.len() - 1..]), text(&[solved(452.0)]));
            Ok::<usize, ExportError>(found.len() - 1)
        };
        for cut in 0..whole.len() {
            let records = usize::from(cut >= one);
            assert_eq!(sound(&whole[..cut]).unwrap(), records, "cut at {cut}");
        }
        for at in MARK.len()..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x40;
            assert_eq!(
                sound(&damaged).unwrap(),
                usize::from(at >= one),
                "byte {at}"
            );
        }
        let mut other = whole.clone();
        other[0] = b'x';
        let error = sound(&other).unwrap_err();
        assert!(error.to_string().contains("no journal"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), other);
    }

    /// A curve that folds has several solutions at one frequency, and one that was solved again has
    /// two records.
    #[test]
    fn solutions_at_one_frequency_are_told_apart_by_their_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let lower = solved(450.0);
        let (mut upper, mut again) = (lower.clone(), lower.clone());
        upper.orbit.point = 451;
        upper.orbit.x[0] = 7.0;
        again.again = true;
        let all = [lower, upper, again];
        let mut journal = Journal::open(&path).unwrap();
        for solved in all.iter().chain(&all) {
            journal.append(&INPUTS, solved).unwrap();
        }
        drop(journal);
        let found = Journal::open(&path).unwrap().solved(&INPUTS).unwrap();
        assert_eq!(text(&found), text(&all));
    }

    #[test]
    fn a_pipe_in_its_place_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("peaks.journal");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        let error = Journal::open(&path).unwrap_err();
        assert!(error.to_string().contains("a named pipe"), "{error}");
    }
}
