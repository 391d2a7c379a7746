//! The protobuf schemas in a recording.

mod declarations;

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
};

use declarations::{DECLARATIONS, Declaration, Field, Kind};

/// Full name of the schema of `/particles`.
pub(super) const POINT_CLOUD: &str = "foxglove.PointCloud";
/// Full name of the schema of `/tf`.
pub(super) const FRAME_TRANSFORM: &str = "foxglove.FrameTransform";
/// Full name of the schema of `/scene`.
pub(super) const SCENE_UPDATE: &str = "foxglove.SceneUpdate";
/// Full name of the schema of `/keyframe`.
pub(super) const KEYFRAME: &str = "catenary.Keyframe";

/// Returns the encoded `FileDescriptorSet` of `root` (a full name) and its dependencies.
pub(super) fn file_descriptor_set(root: &'static str) -> Vec<u8> {
    let mut needed = vec![root];
    // Dependencies come before their users, so one pass in reverse finds all of them.
    let mut files = Vec::new();
    for declaration in DECLARATIONS.iter().rev() {
        if needed.contains(&declaration.full_name().as_str()) {
            needed.extend(declaration.dependencies());
            files.push(declaration.file_descriptor());
        }
    }
    files.reverse();
    FileDescriptorSet { file: files }.encode_to_vec()
}

impl Declaration {
    fn full_name(&self) -> String {
        format!("{}.{}", self.package, self.name)
    }

    /// Returns the full names of the messages in its fields.
    fn dependencies(&self) -> impl Iterator<Item = &'static str> {
        self.fields.iter().filter_map(|(_, _, kind)| match kind {
            Kind::Message(name) | Kind::List(name) => Some(*name),
            Kind::Plain(_) | Kind::Numbers(_) | Kind::Enum { .. } => None,
        })
    }

    fn file_descriptor(&self) -> FileDescriptorProto {
        let names: Vec<_> = self.dependencies().collect();
        let dependency = DECLARATIONS
            .iter()
            .filter(|other| names.contains(&other.full_name().as_str()))
            .map(|other| other.file.to_owned())
            .collect();
        FileDescriptorProto {
            name: Some(self.file.to_owned()),
            package: Some(self.package.to_owned()),
            dependency,
            message_type: vec![self.descriptor()],
            syntax: Some("proto3".to_owned()),
            ..FileDescriptorProto::default()
        }
    }

    fn descriptor(&self) -> DescriptorProto {
        let enums = self.fields.iter().filter_map(|(_, _, kind)| match kind {
            Kind::Enum { name, values } => Some(enum_descriptor(name, values)),
            _ => None,
        });
        DescriptorProto {
            name: Some(self.name.to_owned()),
            field: self.fields.iter().map(|field| self.field(*field)).collect(),
            enum_type: enums.collect(),
            ..DescriptorProto::default()
        }
    }

    fn field(&self, (name, number, kind): Field) -> FieldDescriptorProto {
        let (label, r#type, type_name) = match kind {
            Kind::Plain(plain) => (Label::Optional, plain, None),
            Kind::Message(message) => (Label::Optional, Type::Message, Some(format!(".{message}"))),
            Kind::List(message) => (Label::Repeated, Type::Message, Some(format!(".{message}"))),
            Kind::Numbers(number) => (Label::Repeated, number, None),
            Kind::Enum { name, .. } => {
                let full_name = format!(".{}.{name}", self.full_name());
                (Label::Optional, Type::Enum, Some(full_name))
            }
        };
        FieldDescriptorProto {
            name: Some(name.to_owned()),
            number: Some(number),
            label: Some(label.into()),
            r#type: Some(r#type.into()),
            type_name,
            ..FieldDescriptorProto::default()
        }
    }
}

fn enum_descriptor(name: &str, values: &[&str]) -> EnumDescriptorProto {
    let value = |(number, name): (i32, &&str)| EnumValueDescriptorProto {
        name: Some((*name).to_owned()),
        number: Some(number),
        options: None,
    };
    EnumDescriptorProto {
        name: Some(name.to_owned()),
        value: (0..).zip(values).map(value).collect(),
        ..EnumDescriptorProto::default()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use prost::encoding::{WireType, decode_key, decode_varint};
    use sim_contract::ParticleState;
    use sim_solver::scene::Up;

    use super::*;
    use crate::log::encoding::MessageEncoder;
    use crate::log::encoding::protobuf::{encode_keyframe, encode_transform};

    fn messages(root: &'static str) -> BTreeMap<String, DescriptorProto> {
        let set = FileDescriptorSet::decode(file_descriptor_set(root).as_slice()).unwrap();
        set.file
            .iter()
            .flat_map(|file| {
                let package = file.package().to_owned();
                file.message_type
                    .iter()
                    .map(move |message| (format!(".{package}.{}", message.name()), message.clone()))
            })
            .collect()
    }

    /// Parses a message by its wire format and requires a declaration of every field in it. Returns
    /// the number of fields.
    fn check(schemas: &BTreeMap<String, DescriptorProto>, name: &str, mut wire: &[u8]) -> usize {
        let schema = schemas.get(name).unwrap_or_else(|| panic!("{name} is not declared"));
        let mut checked_count = 0;
        while !wire.is_empty() {
            let (number, wire_type) = decode_key(&mut wire).unwrap();
            let field = schema
                .field
                .iter()
                .find(|field| field.number() == i32::try_from(number).unwrap())
                .unwrap_or_else(|| panic!("{name} has no field {number}"));
            checked_count += 1;
            let (expected, length) = match field.r#type() {
                Type::Double => (WireType::SixtyFourBit, 8),
                Type::Fixed32 => (WireType::ThirtyTwoBit, 4),
                Type::Int32 | Type::Int64 | Type::Uint64 | Type::Enum => {
                    decode_varint(&mut wire).unwrap();
                    (WireType::Varint, 0)
                }
                _ => {
                    let length = decode_varint(&mut wire).unwrap();
                    (WireType::LengthDelimited, usize::try_from(length).unwrap())
                }
            };
            assert_eq!(wire_type, expected, "{name}.{}", field.name());
            let (value, rest) = wire.split_at(length);
            if field.r#type() == Type::Message {
                checked_count += check(schemas, field.type_name(), value);
            }
            wire = rest;
        }
        checked_count
    }

    #[test]
    fn the_schema_of_particles_declares_every_written_field() {
        let mut encoder = MessageEncoder::default();
        let message = encoder.encode_particles(&[ParticleState::default(); 2], 1_000_000_001);
        let checked = check(&messages(POINT_CLOUD), ".foxglove.PointCloud", message);
        assert!(checked > 30, "{checked} fields");
    }

    #[test]
    fn the_schema_of_tf_declares_every_written_field() {
        let message = encode_transform(1_000_000_001, [1.0, 2.0, 3.0], Up::Y);
        let checked = check(&messages(FRAME_TRANSFORM), ".foxglove.FrameTransform", &message);
        assert_eq!(checked, 5 + 2 + 3 + 2);
    }

    #[test]
    fn the_schema_of_keyframes_declares_every_written_field() {
        let mut message = Vec::new();
        encode_keyframe(7, &[1, 2, 3], &mut message);
        assert_eq!(check(&messages(KEYFRAME), ".catenary.Keyframe", &message), 2);
    }

    #[test]
    fn every_file_comes_after_its_imports() {
        for root in [POINT_CLOUD, FRAME_TRANSFORM, SCENE_UPDATE, KEYFRAME] {
            let set = FileDescriptorSet::decode(file_descriptor_set(root).as_slice()).unwrap();
            for (place, file) in set.file.iter().enumerate() {
                for import in &file.dependency {
                    assert!(set.file[..place].iter().any(|earlier| earlier.name() == import));
                }
            }
        }
    }
}
