//! The record of how a picture was made, read back from its file.

use std::io::Cursor;
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use tiff::tags::Tag;

use super::{Format, load};
use crate::base::error::Result;

/// The record that [`write`](super::write) put into this file
/// ([`WriteOptions::record`](super::WriteOptions)); `None` if there is none, or none that can be
/// read.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io), [`Error::Memory`](crate::Error::Memory).
pub fn read_record(path: &Path) -> Result<Option<String>> {
    let bytes = load(path)?;
    Ok(match Format::sniff(&bytes, path) {
        Some(Format::Png) => from_png(&bytes),
        Some(Format::Jpeg) => from_jpeg(&bytes),
        Some(Format::Exr) => from_exr(&bytes),
        Some(Format::Tiff) => from_tiff(&bytes),
        _ => None,
    })
}

/// Text as [`WriteOptions::record`](super::WriteOptions) is stored: our name, a zero byte, ASCII.
fn after_name(payload: &[u8]) -> Option<String> {
    String::from_utf8(payload.strip_prefix(b"texforge\0")?.to_vec()).ok()
}

/// The first `tEXt` chunk of ours.
fn from_png(bytes: &[u8]) -> Option<String> {
    let mut rest = bytes.get(8..)?;
    loop {
        let length = u32::from_be_bytes(*rest.first_chunk()?) as usize;
        let kind = rest.get(4..8)?;
        let payload = rest.get(8..length.checked_add(8)?)?;
        if kind == b"tEXt"
            && let Some(record) = after_name(payload)
        {
            return Some(record);
        }
        // Behind the payload stands a checksum of four bytes.
        rest = rest.get(length.checked_add(12)?..)?;
    }
}

/// The first comment segment of ours.
fn from_jpeg(bytes: &[u8]) -> Option<String> {
    const COMMENT: u8 = 0xfe;
    const SCAN: u8 = 0xda;
    let mut rest = bytes.get(2..)?;
    loop {
        let &[0xff, marker, high, low] = rest.first_chunk()? else { return None };
        let length = usize::from(u16::from_be_bytes([high, low]));
        let payload = rest.get(4..2 + length)?;
        match marker {
            COMMENT => {
                if let Some(record) = after_name(payload) {
                    return Some(record);
                }
            }
            SCAN => return None,
            _ => {}
        }
        rest = rest.get(2 + length..)?;
    }
}

/// The attribute of the first layer.
fn from_exr(bytes: &[u8]) -> Option<String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).ok()?;
    match meta.headers.first()?.own_attributes.other.get(&Text::from("texforge"))? {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}

/// The software tag.
fn from_tiff(bytes: &[u8]) -> Option<String> {
    let mut decoder = tiff::decoder::Decoder::new(Cursor::new(bytes)).ok()?;
    let software = decoder.get_tag_ascii_string(Tag::Software).ok()?;
    software.strip_prefix("texforge ").map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::io::{WriteOptions, write};
    use crate::image::material::MapKind;
    use crate::image::picture::{Encoding, Picture, Samples};
    use proptest::prelude::*;

    #[test]
    fn records_come_back() {
        let folder = tempfile::tempdir().expect("folder");
        let gray = Picture::new(1, 2, 1, Samples::U8(vec![1, 2]), Encoding::Srgb).expect("gray");
        for name in ["a.png", "a.jpg", "a.exr", "a.tif"] {
            let path = folder.path().join(name);
            let record = Some(r#"{"seed":7}"#.to_owned());
            let options =
                WriteOptions { record: record.clone(), ..WriteOptions::new(MapKind::Color) };
            write(&path, &gray, &options).expect("write");
            assert_eq!(read_record(&path).expect("read"), record, "{name}");
            let options = WriteOptions { force: true, ..WriteOptions::new(MapKind::Color) };
            write(&path, &gray, &options).expect("write");
            assert_eq!(read_record(&path).expect("read"), None, "{name}");
        }
    }

    proptest! {
        #[test]
        fn garbage_holds_no_record_and_does_no_harm(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
            for magic in [&b"\x89PNG\r\n\x1a\n"[..], b"\xff\xd8\xff", b"\x76\x2f\x31\x01", b"II*\0"] {
                let file = [magic, &bytes].concat();
                from_png(&file);
                from_jpeg(&file);
                from_exr(&file);
                from_tiff(&file);
            }
        }
    }
}
