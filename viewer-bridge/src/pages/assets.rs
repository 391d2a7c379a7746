//! The files of the page: built into the program, or read from a folder during development.

mod files;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use xxhash_rust::xxh3::xxh3_64;

use files::{FILES, PICTURES};

/// The origin of the files.
#[derive(Debug, Clone, Default)]
pub enum Assets {
    /// The files in the program.
    #[default]
    Embedded,
    /// The files in this folder, read at each request.
    Folder(PathBuf),
}

impl Assets {
    /// Uses the files of a folder.
    ///
    /// # Errors
    /// The path is not a folder, or cannot be read.
    pub fn folder(path: &Path) -> io::Result<Self> {
        let folder = path.canonicalize()?;
        if folder.is_dir() {
            Ok(Self::Folder(folder))
        } else {
            Err(io::ErrorKind::NotADirectory.into())
        }
    }

    /// Answers a request for a path such as `js/main.js`. The empty path is the page.
    pub(crate) fn answer(&self, path: &str, headers: &HeaderMap) -> Response {
        let path = if path.is_empty() { "index.html" } else { path };
        let (Some(content), Some(mime)) = (self.content(path), mime(path)) else {
            return (StatusCode::NOT_FOUND, "no such file\n").into_response();
        };
        let tag = format!("\"{:016x}\"", xxh3_64(&content));
        if headers
            .get(header::IF_NONE_MATCH)
            .is_some_and(|known| known.as_bytes() == tag.as_bytes())
        {
            return (StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response();
        }
        let headers = [(header::CONTENT_TYPE, mime.to_owned()), (header::ETAG, tag)];
        (headers, content).into_response()
    }

    fn content(&self, path: &str) -> Option<Vec<u8>> {
        // The pictures belong to the built-in scenes, so a folder for development has none.
        if let Some((_, content)) = PICTURES.iter().find(|(known, _)| *known == path) {
            return Some(content.to_vec());
        }
        match self {
            Self::Embedded => {
                let file = FILES.iter().find(|(known, _)| *known == path);
                file.map(|(_, content)| content.to_vec())
            }
            Self::Folder(folder) => {
                // A path that leaves the folder, by dots or by a link, does not exist.
                let file = folder.join(path).canonicalize().ok()?;
                if file.starts_with(folder) { fs::read(file).ok() } else { None }
            }
        }
    }
}

/// Media type of a file. Files of other types are not served.
fn mime(path: &str) -> Option<&'static str> {
    let (_, ending) = path.rsplit_once('.')?;
    Some(match ending {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "json" | "map" => "application/json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::scene::catalog::Catalog;

    fn status(assets: &Assets, path: &str) -> StatusCode {
        assets.answer(path, &HeaderMap::new()).status()
    }

    #[test]
    fn every_embedded_file_has_a_type_and_nothing_else_is_there() {
        for (path, _) in FILES {
            assert_eq!(status(&Assets::Embedded, path), StatusCode::OK, "{path}");
        }
        assert_eq!(status(&Assets::Embedded, ""), StatusCode::OK);
        assert_eq!(status(&Assets::Embedded, "../Cargo.toml"), StatusCode::NOT_FOUND);
    }

    /// Adds the files of a folder that a browser asks for.
    fn add_files(folder: &Path, paths: &mut BTreeSet<PathBuf>) {
        for entry in folder.read_dir().unwrap().map(|entry| entry.unwrap().path()) {
            let is_for_developers =
                ["node_modules", "test"].iter().any(|name| entry.ends_with(name));
            if entry.is_dir() && !is_for_developers {
                add_files(&entry, paths);
            } else if entry
                .extension()
                .is_some_and(|one| ["html", "css", "js"].iter().any(|known| one == *known))
            {
                paths.insert(entry);
            }
        }
    }

    #[test]
    fn every_file_of_the_page_is_embedded() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
        let mut paths = BTreeSet::new();
        add_files(&folder, &mut paths);
        let embedded: BTreeSet<_> = FILES.iter().map(|(path, _)| folder.join(path)).collect();
        assert_eq!(embedded, paths);
    }

    #[test]
    fn every_built_in_scene_has_a_picture() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
        for assets in [Assets::Embedded, Assets::folder(&folder).unwrap()] {
            for scene in Catalog::default().entries() {
                let path = scene.picture.as_deref().unwrap();
                let answer = assets.answer(path, &HeaderMap::new());
                assert_eq!(answer.status(), StatusCode::OK, "{path}");
                assert_eq!(answer.headers()[header::CONTENT_TYPE], "image/png");
            }
        }
    }

    #[test]
    fn a_folder_serves_nothing_from_outside() {
        let assets = Assets::folder(Path::new(env!("CARGO_MANIFEST_DIR")).join("web").as_path());
        let assets = assets.unwrap();
        assert_eq!(status(&assets, "index.html"), StatusCode::OK);
        for path in ["../PROTOCOL.md", "../tests/golden/messages.json", "/etc/passwd.json", "js"] {
            assert_eq!(status(&assets, path), StatusCode::NOT_FOUND, "{path}");
        }
    }

    #[test]
    fn a_client_with_the_current_file_receives_not_modified() {
        let first = Assets::Embedded.answer("", &HeaderMap::new());
        let mut headers = HeaderMap::new();
        headers.insert(header::IF_NONE_MATCH, first.headers()[header::ETAG].clone());
        assert_eq!(Assets::Embedded.answer("", &headers).status(), StatusCode::NOT_MODIFIED);
    }
}
