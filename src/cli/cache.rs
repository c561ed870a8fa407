//! `comber cache`.

use super::args::{CacheAction, CacheArgs, CacheClearArgs, CacheFolderArgs};
use super::exit::Done;
use super::report::{self, path_json, table};
use crate::cache::Cache;
use crate::cache::folder::{DEFAULT_LIMIT, Entry};
use crate::error::{Error, Result};
use crate::measure::units;
use serde_json::{Value, json};
use std::time::{SystemTime, UNIX_EPOCH};

/// Lists or removes trees.
pub fn run(args: CacheArgs) -> anyhow::Result<Done> {
    match args.action {
        CacheAction::Path(args) => path(&args)?,
        CacheAction::Ls(args) => list(&args)?,
        CacheAction::Clear(args) => clear(&args)?,
    }
    Ok(Done::Finished)
}

/// The cache that is meant.
fn cache(args: &CacheFolderArgs) -> Result<Cache> {
    let folder = args.cache.clone().or_else(Cache::users_folder);
    let folder =
        folder.ok_or_else(|| Error::Options("this user has no home folder, so name the cache with --cache".into()))?;
    Ok(Cache { folder, limit: DEFAULT_LIMIT })
}

fn path(args: &CacheFolderArgs) -> anyhow::Result<()> {
    let folder = cache(args)?.folder;
    if args.json {
        return Ok(report::print_json(&json!({ "folder": path_json(&folder) }))?);
    }
    Ok(report::print(&format!("{}\n", folder.display()))?)
}

fn list(args: &CacheFolderArgs) -> anyhow::Result<()> {
    let cache = cache(args)?;
    let entries = cache.entries()?;
    let bytes = entries.iter().map(|entry| entry.bytes).sum::<u64>();
    if args.json {
        let trees: Vec<_> = entries.iter().map(entry_json).collect();
        return Ok(report::print_json(&json!({ "folder": path_json(&cache.folder), "bytes": bytes, "trees": trees }))?);
    }
    if entries.is_empty() {
        return Ok(report::print(&format!("{}: no trees\n", cache.folder.display()))?);
    }
    let rows = entries.iter().map(|entry| {
        let (scene, primitives, build) = match entry.header() {
            Ok(header) => {
                (header.name(), units::count(header.primitives), report::seconds(header.build_seconds.max(0.0)))
            }
            Err(why) => (format!("damaged: {why}"), "–".into(), "–".into()),
        };
        let key = entry.key.to_string()[..12].to_owned();
        [key, scene, primitives, units::bytes(entry.bytes), build, ago(entry.used)]
    });
    let trees = table(["key", "scene", "primitives", "size", "built in", "last used"], 2, rows);
    let count = match entries.len() {
        1 => "1 tree".to_owned(),
        count => format!("{count} trees"),
    };
    let sum = format!("{count}, {} in {}", units::bytes(bytes), cache.folder.display());
    Ok(report::print(&format!("{trees}\n\n {sum}\n"))?)
}

fn clear(args: &CacheClearArgs) -> anyhow::Result<()> {
    let cache = cache(&args.folder)?;
    if let Some(digits) = &args.key {
        let of = |entry: &&Entry| entry.key.to_string().starts_with(digits.as_str());
        match cache.entries()?.iter().filter(of).count() {
            0 => return Err(Error::Options(format!("{}: no tree has the key {digits}", cache.folder.display())).into()),
            1 => {}
            count => return Err(Error::Options(format!("{count} trees have keys that start with {digits}")).into()),
        }
    }
    let removed = cache.clear(|entry| match (&args.key, args.older_than) {
        (Some(digits), _) => entry.key.to_string().starts_with(digits.as_str()),
        (None, Some(age)) => entry.used.elapsed().is_ok_and(|unused| unused > age),
        (None, None) => true,
    })?;
    let bytes = removed.iter().map(|entry| entry.bytes).sum::<u64>();
    if args.folder.json {
        let keys: Vec<_> = removed.iter().map(|entry| entry.key.to_string()).collect();
        return Ok(report::print_json(&json!({ "removed": keys, "bytes": bytes }))?);
    }
    let count = units::count(removed.len() as u64);
    Ok(report::print(&format!("removed {count}, {}, from {}\n", units::bytes(bytes), cache.folder.display()))?)
}

fn entry_json(entry: &Entry) -> Value {
    let used = entry.used.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let mut value = json!({
        "key": entry.key.to_string(),
        "file": path_json(&entry.path),
        "bytes": entry.bytes,
        "used": used,
    });
    match entry.header() {
        Ok(header) => {
            value["scene"] = header.name().into();
            value["options"] = header.options().into();
            value["primitives"] = header.primitives.into();
            value["build_seconds"] = header.build_seconds.into();
        }
        Err(why) => value["damaged"] = why.into(),
    }
    value
}

/// How long ago something was.
fn ago(time: SystemTime) -> String {
    // Clocks may be set back.
    let seconds = time.elapsed().unwrap_or_default().as_secs();
    match seconds {
        0..60 => "just now".into(),
        60..3600 => format!("{} min ago", seconds / 60),
        3600..172_800 => format!("{} h ago", seconds / 3600),
        _ => format!("{} days ago", seconds / 86_400),
    }
}
