//! The folder of cached trees: which there are, which to drop.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::file::{self, Header, Image};
use super::key::Key;
use crate::bvh::{Accel, Bvh4};
use crate::error::{Error, Result};
use crate::film::atomic_file;
use crate::options::AccelOptions;
use crate::scene::shapes::Shapes;

/// What a cache may fill by default.
pub const DEFAULT_LIMIT: u64 = 8 << 30;

const EXTENSION: &str = "bvh";
/// Temporary files older than this were left behind by a process that was killed.
const ABANDONED: Duration = Duration::from_secs(3600);

/// A folder of trees.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    /// The folder; it need not exist.
    pub folder: PathBuf,
    /// The most bytes that all files may have together.
    pub limit: u64,
}

/// A file of the cache.
#[derive(Debug)]
pub struct Entry {
    /// Its name as a key.
    pub key: Key,
    /// The file.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
    /// When it was last loaded or stored.
    pub used: SystemTime,
}

impl Entry {
    /// Its header, or what is wrong with it.
    pub fn header(&self) -> std::result::Result<Header, String> {
        let mut file = File::open(&self.path).map_err(|e| format!("it cannot be read: {e}"))?;
        Header::read(&mut file, self.bytes)
    }
}

/// What a cache has for a key.
#[derive(Debug)]
pub enum Found {
    /// The tree, and what stands beside it.
    Tree(Box<Accel>),
    /// Nothing.
    Nothing,
    /// A file that cannot be used, and why.
    Damaged(String),
}

impl Cache {
    /// comber's folder in the user's cache folder: `$XDG_CACHE_HOME/comber`, or what the system has in its place. `None` if
    /// the user has no home.
    pub fn users_folder() -> Option<PathBuf> {
        use etcetera::BaseStrategy as _;
        Some(etcetera::base_strategy::choose_native_strategy().ok()?.cache_dir().join("comber"))
    }

    /// The file of a key.
    pub fn path(&self, key: Key) -> PathBuf {
        self.folder.join(format!("{key}.{EXTENSION}"))
    }

    /// Looks for the tree over `shapes`, whose key is `key`.
    pub fn load(&self, key: Key, shapes: &Shapes, options: &AccelOptions) -> Found {
        let path = self.path(key);
        // Before opening: opening a pipe would wait for its writer.
        match fs::metadata(&path) {
            Ok(metadata) if metadata.is_file() => {}
            Ok(_) => return Found::Damaged("it is not a regular file".into()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Found::Nothing,
            Err(error) => return Found::Damaged(format!("it cannot be read: {error}")),
        }
        let file = match File::open(&path) {
            Ok(file) => file,
            // Evicted just now.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Found::Nothing,
            Err(error) => return Found::Damaged(format!("it cannot be read: {error}")),
        };
        // What was used last is evicted last. A folder that cannot be written to is not evicted from either.
        let _ = file.set_modified(SystemTime::now());
        match file::load(file, key, shapes, options) {
            Ok(tree) => Found::Tree(Box::new(tree)),
            Err(why) => Found::Damaged(why),
        }
    }

    /// Writes the tree that [`Accel::tree`] gives, replacing what has its name, and evicts what was not used for longest beyond the limit.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be made or written to; [`Error::Options`] if the tree alone exceeds the limit.
    pub fn store(
        &self,
        key: Key,
        tree: &Bvh4,
        name: &str,
        options: &AccelOptions,
        progress: &dyn Fn(u64, u64),
    ) -> Result<PathBuf> {
        let path = self.path(key);
        let image = Image::new(tree, key, name, options);
        let bytes = image.bytes();
        if bytes > self.limit {
            return Err(Error::Options(format!(
                "{}: the tree takes {bytes} bytes, and the cache may have {} (--cache-limit)",
                path.display(),
                self.limit
            )));
        }
        make_private(&self.folder).map_err(|e| Error::io(&self.folder, "make the folder", e))?;
        // A file that is read-only would not be replaced, and a pipe would be written to. Others are not removed before the new
        // one is whole: this process may be killed.
        if fs::symlink_metadata(&path)
            .is_ok_and(|found| !found.is_dir() && (!found.is_file() || found.permissions().readonly()))
        {
            remove(&path)?;
        }
        // Room first: a disk that is just large enough need not hold both.
        self.evict(self.limit - bytes, Some(key))?;
        atomic_file::write(&path, |out| image.write(&path, out, &|done| progress(done, bytes)))?;
        Ok(path)
    }

    /// The files of the cache, those used last first. Files of other names are not the cache's.
    pub fn entries(&self) -> Result<Vec<Entry>> {
        let failed = |e| Error::io(&self.folder, "read", e);
        let files = match fs::read_dir(&self.folder) {
            Ok(files) => files,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(failed(error)),
        };
        let mut entries = Vec::new();
        for file in files {
            let path = file.map_err(failed)?.path();
            let stem = path.file_stem().and_then(|stem| stem.to_str()).and_then(|stem| stem.parse().ok());
            let Some(key) = stem.filter(|_| path.extension().is_some_and(|e| e == EXTENSION)) else { continue };
            // One that is gone by now was evicted by another process.
            let Ok(metadata) = fs::metadata(&path) else { continue };
            if metadata.is_file() {
                let used = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                entries.push(Entry { key, path, bytes: metadata.len(), used });
            }
        }
        entries.sort_by(|a, b| b.used.cmp(&a.used).then(a.key.cmp(&b.key)));
        Ok(entries)
    }

    /// Removes the files used longest ago until the others fit into `limit` bytes, not counting `spared`, and what
    /// killed processes have left.
    pub fn evict(&self, limit: u64, spared: Option<Key>) -> Result<()> {
        let mut sum = 0u64;
        for entry in self.entries()?.iter().filter(|entry| Some(entry.key) != spared) {
            sum = sum.saturating_add(entry.bytes);
            if sum > limit {
                remove(&entry.path)?;
            }
        }
        self.remove_abandoned();
        Ok(())
    }

    /// Removes the files for which `doomed` holds, and what killed processes have left; tells which they were.
    pub fn clear(&self, doomed: impl Fn(&Entry) -> bool) -> Result<Vec<Entry>> {
        let (doomed, _): (Vec<_>, Vec<_>) = self.entries()?.into_iter().partition(doomed);
        doomed.iter().try_for_each(|entry| remove(&entry.path))?;
        self.remove_abandoned();
        Ok(doomed)
    }

    /// Removes temporary files that no process can still be writing.
    fn remove_abandoned(&self) {
        let files = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        for file in files {
            let name = file.file_name().to_string_lossy().into_owned();
            let age = file.metadata().and_then(|m| m.modified()).ok().and_then(|time| time.elapsed().ok());
            if name.starts_with(".comber-") && name.ends_with(".tmp") && age.is_some_and(|age| age > ABANDONED) {
                let _ = fs::remove_file(file.path());
            }
        }
    }
}

/// Another process may have been faster.
fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io(path, "remove", error)),
        _ => Ok(()),
    }
}

/// Makes a folder that only its user may enter, and those above it.
pub(crate) fn make_private(folder: &Path) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.recursive(true).create(folder)
}
