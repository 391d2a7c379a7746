//! Formats of meshes and pictures that are not read, told by their content.

/// The beginnings of files.
const SIGNATURES: [(&[u8], &str); 14] = [
    (b"glTF", "a glTF file (binary)"),
    (b"#usda", "a USD file (text)"),
    (b"PXR-USDC", "a USD file (crate)"),
    (b"ply\n", "a PLY file"),
    (b"ply\r", "a PLY file"),
    (b"Kaydara FBX Binary", "an FBX file"),
    (b"; FBX", "an FBX file"),
    (b"BLENDER", "a file of Blender"),
    (b"Ogawa", "an Alembic file"),
    (b"\x89PNG\r\n\x1a\n", "a picture (PNG)"),
    (b"\xff\xd8\xff", "a picture (JPEG)"),
    (b"OFF\n", "an OFF file"),
    (b"OFF\r", "an OFF file"),
    (b"OFF ", "an OFF file"),
];
/// The beginning of a ZIP archive, and the place of the first file's name in it.
const ZIP: (&[u8], usize) = (b"PK\x03\x04", 30);
/// Sizes of the header of a binary STL file, of the count that follows, and of each triangle.
const STL_SIZES_BYTES: [usize; 3] = [80, 4, 50];

/// Returns the format of a file that is neither a scene nor an OBJ mesh, if it has a known one. `bytes` is
/// its beginning.
pub(crate) fn other_format(bytes: &[u8], size_bytes: u64) -> Option<&'static str> {
    let signature = SIGNATURES.into_iter().find(|(start, _)| bytes.starts_with(start));
    signature
        .map(|(_, name)| name)
        .or_else(|| zip_archive(bytes))
        .or_else(|| stl(bytes, size_bytes))
        .or_else(|| gltf_text(bytes))
        .or_else(|| collada(bytes))
}

fn zip_archive(bytes: &[u8]) -> Option<&'static str> {
    let (start, name_place) = ZIP;
    let name = bytes.strip_prefix(start).and(bytes.get(name_place..))?;
    // The first file of a USDZ archive is the stage.
    let is_usd = name.iter().take_while(|byte| byte.is_ascii_graphic()).count();
    let is_usd = name[..is_usd].windows(4).any(|part| part == b".usd");
    Some(if is_usd { "a USD file (USDZ)" } else { "a ZIP archive" })
}

fn stl(bytes: &[u8], size_bytes: u64) -> Option<&'static str> {
    if bytes.starts_with(b"solid") && contains(bytes, b"facet") {
        return Some("an STL file (text)");
    }
    let [header, count_size, triangle_size] = STL_SIZES_BYTES;
    let count = bytes.get(header..header + count_size)?;
    let count = u64::from(u32::from_le_bytes(count.try_into().ok()?));
    let expected = (header + count_size) as u64 + count * triangle_size as u64;
    (size_bytes == expected).then_some("an STL file (binary)")
}

/// No scene and no mesh begins with a brace.
fn gltf_text(bytes: &[u8]) -> Option<&'static str> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    (text.starts_with(b"{") && contains(text, b"\"asset\"")).then_some("a glTF file (JSON)")
}

/// No scene and no other mesh begins with a tag.
fn collada(bytes: &[u8]) -> Option<&'static str> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    (text.starts_with(b"<") && contains(text, b"<COLLADA")).then_some("a COLLADA file")
}

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|part| part == word)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn format(bytes: &[u8]) -> Option<&'static str> {
        other_format(bytes, bytes.len() as u64)
    }

    fn zip(name: &str) -> Vec<u8> {
        let size = u8::try_from(name.len()).unwrap();
        let mut bytes = b"PK\x03\x04".to_vec();
        bytes.resize(26, 0);
        bytes.extend_from_slice(&[size, 0, 0, 0]);
        bytes.extend_from_slice(name.as_bytes());
        bytes.extend_from_slice(b"\0\xff\0");
        bytes
    }

    /// Two triangles behind a header with this text.
    fn binary_stl(header: &[u8]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend_from_slice(&2_u32.to_le_bytes());
        bytes.resize(84 + 2 * 50, 0);
        bytes
    }

    #[test]
    fn each_format_is_told_by_its_content() {
        for (bytes, expected) in [
            (b"glTF\x02\0\0\0".to_vec(), "a glTF file (binary)"),
            (b"\xef\xbb\xbf {\n\"scenes\":[],\n \"asset\": {}}".to_vec(), "a glTF file (JSON)"),
            (b"#usda 1.0\n(\n)\n".to_vec(), "a USD file (text)"),
            (b"PXR-USDC\0\x08".to_vec(), "a USD file (crate)"),
            (zip("shirt.usdc"), "a USD file (USDZ)"),
            (zip("3D/model.xml"), "a ZIP archive"),
            (b"solid shirt\n facet normal 0 0 1\n".to_vec(), "an STL file (text)"),
            (binary_stl(b"solid by a careless program"), "an STL file (binary)"),
            (binary_stl(b"v 0 0 0"), "an STL file (binary)"),
            (b"ply\r\nformat ascii 1.0\n".to_vec(), "a PLY file"),
            (b"Kaydara FBX Binary  \0".to_vec(), "an FBX file"),
            (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec(), "a picture (PNG)"),
            (b"\xff\xd8\xff\xe0\0\x10JFIF".to_vec(), "a picture (JPEG)"),
            (b"OFF\n8 6 12\n".to_vec(), "an OFF file"),
            (b"OFF 8 6 12\n".to_vec(), "an OFF file"),
            (b"<?xml version=\"1.0\"?>\n<COLLADA version=\"1.4.1\">".to_vec(), "a COLLADA file"),
        ] {
            assert_eq!(format(&bytes), Some(expected));
        }
    }

    #[test]
    fn scenes_and_meshes_have_no_other_format() {
        let comment = format!("# {}\nversion = 1\n", "solid facet ply ".repeat(20));
        for text in ["", "version = 1\n", "v 0 0 0\n", "# Blender\no ply\n", "g solid\n", &comment]
        {
            assert_eq!(format(text.as_bytes()), None, "{text}");
        }
    }
}
