//! Folder of the cache. The subfolder has the entries and is marked as a cache. Nothing outside of
//! it is changed. Inside it only regular files are removed whose name is that of an entry, of a
//! part of one, or of a lock.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use dovetail_export::name_of_part;
use dovetail_superelement::input;

/// Name of the subfolder in the folder given by `--cache`; the number is that of the layout.
const SUBFOLDER: &str = "dovetail-cache-1";
/// File that marks a cache, by the Cache Directory Tagging Specification (bford.info/cachedir).
const TAG: &str = "CACHEDIR.TAG";
const SIGNATURE: &str = "Signature: 8a477f597d28d172789f06886806bc55";
const TAG_TEXT: &str = "Signature: 8a477f597d28d172789f06886806bc55
# This folder is a cache of dovetail: meshes and reduced models of earlier runs.
# It may be removed at any time. Only files that dovetail made are removed from it.
";

/// Kind of content of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EntryKind {
    Mesh,
    ReducedModel,
    Recovery,
    /// Modes of each body with its flanks held.
    HeldModes,
}

impl EntryKind {
    const ALL: [Self; 4] = [
        Self::Mesh,
        Self::ReducedModel,
        Self::Recovery,
        Self::HeldModes,
    ];

    /// Word for the kind in names of files and in messages.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::ReducedModel => "reduced",
            Self::Recovery => "recovery",
            Self::HeldModes => "held_modes",
        }
    }
}

/// Role of a file of the cache, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Entry,
    /// Incomplete entry.
    Part,
    Lock,
}

/// Role of a file of this name; `None` if the name is not one that the cache gives.
fn role(name: &str) -> Option<Role> {
    let (entry, role) = match (name_of_part(name), name.strip_suffix(".lock")) {
        (Some(entry), _) => (entry, Role::Part),
        (None, Some(entry)) => (entry, Role::Lock),
        (None, None) => (name, Role::Entry),
    };
    let (kind, hash) = entry.split_once('-')?;
    let is_hexadecimal = |c: u8| c.is_ascii_digit() || (b'a'..=b'f').contains(&c);
    let is_entry = EntryKind::ALL.iter().any(|k| k.word() == kind)
        && hash.len() == 64
        && hash.bytes().all(is_hexadecimal);
    is_entry.then_some(role)
}

pub(crate) fn lock_path(entry: &Path) -> PathBuf {
    entry.with_extension("lock")
}

/// Subfolder of the cache.
#[derive(Debug, Clone)]
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn new(parent: &Path) -> Self {
        Self(parent.join(SUBFOLDER))
    }

    /// Folder named by the user.
    pub(crate) fn parent(&self) -> Option<&Path> {
        self.0.parent()
    }

    pub(crate) fn entry(&self, kind: EntryKind, hash: [u8; 32]) -> PathBuf {
        let hash = blake3::Hash::from_bytes(hash).to_hex();
        self.0.join(format!("{}-{hash}", kind.word()))
    }

    fn is_marked(&self) -> bool {
        input::bytes(&self.0.join(TAG)).is_ok_and(|tag| tag.starts_with(SIGNATURE.as_bytes()))
    }

    /// Creates the folder with its mark if it does not exist.
    ///
    /// # Errors
    /// A folder of this name that has other files and no mark; a folder that cannot be created.
    pub(crate) fn prepare(&self) -> io::Result<()> {
        if self.is_marked() {
            return Ok(());
        }
        if let Some(parent) = self.0.parent() {
            fs::create_dir_all(parent)?;
        }
        // Made beside it with its mark, the folder takes its name at once: runs that start together
        // never see it without the mark. The name of a folder that has files cannot be taken.
        let beside = self.0.parent().unwrap_or(Path::new("."));
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let made = builder.prefix(SUBFOLDER).tempdir_in(beside)?;
        let placed = fs::write(made.path().join(TAG), TAG_TEXT)
            .and_then(|()| fs::rename(made.path(), &self.0));
        match (self.is_marked(), placed) {
            (true, _) => Ok(()),
            (false, Err(error)) if error.kind() != io::ErrorKind::DirectoryNotEmpty => Err(error),
            (false, _) => Err(io::Error::other(format!(
                "{} has files and no {TAG}: it is not the cache of this program",
                self.0.display()
            ))),
        }
    }

    /// Removes a file of the cache; any other file stays.
    pub(crate) fn remove(&self, path: &Path) -> io::Result<()> {
        let name = path.file_name().and_then(|name| name.to_str());
        let is_own = path.parent() == Some(self.0.as_path())
            && name.and_then(role).is_some()
            && fs::symlink_metadata(path)?.is_file()
            && self.is_marked();
        if is_own {
            fs::remove_file(path)
        } else {
            Err(io::Error::other("this is no file of the cache"))
        }
    }

    /// Removes the least recently used entries until the total size is within the limit; `newest`
    /// stays. Parts and locks that were not written to for `abandoned` are removed, too.
    pub(crate) fn make_room(&self, limit_bytes: u64, newest: &Path, abandoned: Duration) {
        if !self.is_marked() {
            return;
        }
        let Ok(files) = fs::read_dir(&self.0) else {
            return;
        };
        let (mut entries, mut total) = (Vec::new(), 0);
        for file in files.flatten() {
            let Some(role) = file.file_name().to_str().and_then(role) else {
                continue;
            };
            // Another run may have removed it meanwhile. Of a link, this is about the link.
            let Ok(about) = file.metadata() else { continue };
            if !about.is_file() {
                continue;
            }
            let (path, used) = (file.path(), about.modified().unwrap_or(UNIX_EPOCH));
            match role {
                Role::Entry => {
                    total += about.len();
                    if path != newest {
                        entries.push((used, path, about.len()));
                    }
                }
                Role::Part | Role::Lock => {
                    if used.elapsed().is_ok_and(|age| age > abandoned) {
                        let _ = self.remove(&path); // it is left for the next run
                    }
                }
            }
        }
        entries.sort();
        for (_, path, size) in entries {
            if total <= limit_bytes {
                return;
            }
            if self.remove(&path).is_ok() {
                total -= size;
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use std::fs::File;
    use std::time::SystemTime;
    use tempfile::TempDir;

    /// Prepared cache folder inside a temporary folder, which is removed at the end.
    pub struct Bench {
        parent: TempDir,
        pub folder: Folder,
    }

    impl Bench {
        pub fn new() -> Self {
            let parent = tempfile::tempdir().unwrap();
            let folder = Folder::new(parent.path());
            folder.prepare().unwrap();
            Self { parent, folder }
        }
        pub fn path(&self, name: &str) -> PathBuf {
            self.folder.0.join(name)
        }
        /// File of 100 bytes, last changed `age_s` seconds ago.
        fn file(&self, name: &str, age_s: u64) -> PathBuf {
            let path = self.path(name);
            fs::write(&path, [0; 100]).unwrap();
            let then = SystemTime::now() - Duration::from_secs(age_s);
            let file = File::options().append(true).open(&path).unwrap();
            file.set_modified(then).unwrap();
            path
        }
        /// Names of the files, without the mark.
        pub fn names(&self) -> Vec<String> {
            let files = fs::read_dir(&self.folder.0).unwrap().flatten();
            let names = files.map(|f| f.file_name().into_string().unwrap());
            let mut names: Vec<_> = names.filter(|name| name != TAG).collect();
            names.sort();
            names
        }
    }

    fn entry(digit: char) -> String {
        format!("mesh-{}", String::from(digit).repeat(64))
    }

    #[test]
    fn only_names_that_the_cache_gives_are_its_own() {
        let hash = "0123456789abcdef".repeat(4);
        for kind in EntryKind::ALL {
            let bench = Folder::new(Path::new("x"));
            let path = bench.entry(kind, [0xa5; 32]);
            let of = |path: &Path| role(path.file_name().unwrap().to_str().unwrap());
            assert_eq!(of(&path), Some(Role::Entry));
            let part = path.with_extension("aB3dE6.part");
            assert_eq!(of(&part), Some(Role::Part));
            assert_eq!(of(&lock_path(&path)), Some(Role::Lock));
        }
        for other in [
            "a.lock".to_owned(),
            "Cargo.lock".to_owned(),
            "film.part".to_owned(),
            TAG.to_owned(),
            format!("other-{hash}"),
            format!("mesh-{}", &hash[1..]),
            format!("mesh-{hash}0"),
            format!("mesh-{}", hash.to_uppercase()),
            format!("mesh-{hash}.msh"),
            format!("mesh-{hash}.lock.lock"),
            format!("mesh-{hash}.part"),
            format!("mesh-{hash}.1-2.part"),
            format!("mesh-{hash}.abcdefg.part"),
            format!(" mesh-{hash}"),
        ] {
            assert_eq!(role(&other), None, "{other}");
        }
    }

    #[test]
    fn those_used_longest_ago_leave_first() {
        let bench = Bench::new();
        let [a, b, c, e] = ['a', 'b', 'c', 'e'].map(entry);
        let part = format!("{}.1a2B3c.part", entry('d'));
        for (name, age_s) in [(&b, 50), (&a, 300), (&c, 400), (&part, 500)] {
            bench.file(name, age_s);
        }
        let newest = bench.file(&e, 1000);
        let room = |limit_bytes, abandoned_s| {
            let abandoned = Duration::from_secs(abandoned_s);
            bench.folder.make_room(limit_bytes, &newest, abandoned);
            bench.names()
        };
        assert_eq!(room(400, 3600), [&a, &b, &c, &part, &e].map(String::clone));
        assert_eq!(room(399, 3600), [&a, &b, &part, &e].map(String::clone));
        assert_eq!(room(250, 3600), [&b, &part, &e].map(String::clone));
        assert_eq!(room(10, 60), [e.as_str()]);
    }

    #[test]
    fn what_the_cache_did_not_make_stays() {
        let bench = Bench::new();
        let old = 100_000;
        for name in ["a.lock", "b.part", "data.csv", "mesh-1.lock"] {
            bench.file(name, old);
        }
        let folder = entry('f');
        fs::create_dir(bench.path(&folder)).unwrap();
        let link = entry('1');
        std::os::unix::fs::symlink(bench.path("data.csv"), bench.path(&link)).unwrap();
        let stays = bench.names();
        bench.file(&entry('a'), old);
        bench.file(&format!("{}.lock", entry('b')), old);
        let newest = bench.path(&entry('0'));
        bench.folder.make_room(0, &newest, Duration::from_secs(1));
        assert_eq!(bench.names(), stays);
        for name in &stays {
            assert!(bench.folder.remove(&bench.path(name)).is_err(), "{name}");
        }
        // Nothing outside, whatever its name.
        let outside = bench.parent.path().join(entry('a'));
        fs::write(&outside, "a").unwrap();
        assert!(bench.folder.remove(&outside).is_err() && outside.exists());
    }

    #[test]
    fn without_its_mark_a_folder_is_left_alone() {
        let bench = Bench::new();
        let (name, lock) = (entry('a'), format!("{}.lock", entry('b')));
        for file in [&name, &lock] {
            bench.file(file, 100_000);
        }
        fs::write(bench.path(TAG), "some other text").unwrap();
        let newest = bench.path(&entry('0'));
        bench.folder.make_room(0, &newest, Duration::from_secs(1));
        assert!(bench.folder.remove(&bench.path(&name)).is_err());
        assert_eq!(bench.names(), [name, lock]);
        let refused = bench.folder.prepare().unwrap_err().to_string();
        assert!(refused.contains(TAG), "{refused}");
        let beside = fs::read_dir(&bench.parent).unwrap().count();
        assert_eq!(beside, 1, "nothing is left beside the folder");
        // A folder without any file is taken.
        fs::remove_dir_all(&bench.folder.0).unwrap();
        fs::create_dir(&bench.folder.0).unwrap();
        bench.folder.prepare().unwrap();
        assert!(bench.folder.is_marked());
    }

    #[test]
    fn runs_that_start_together_make_one_marked_folder() {
        let bench = Bench::new();
        for _ in 0..20 {
            fs::remove_dir_all(&bench.folder.0).unwrap();
            std::thread::scope(|scope| {
                for _ in 0..4 {
                    scope.spawn(|| bench.folder.prepare().unwrap());
                }
            });
            assert_eq!(fs::read_dir(&bench.parent).unwrap().count(), 1);
        }
    }
}
