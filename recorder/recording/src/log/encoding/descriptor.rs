//! The protobuf schemas in a recording.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
};

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

/// A message and the file that declares it.
struct Declaration {
    package: &'static str,
    name: &'static str,
    file: &'static str,
    fields: &'static [Field],
}

/// Name, number, type.
type Field = (&'static str, i32, Kind);

#[derive(Clone, Copy)]
enum Kind {
    Plain(Type),
    /// A message, by its full name.
    Message(&'static str),
    /// A list of messages.
    List(&'static str),
    /// A list of numbers.
    Numbers(Type),
    /// An enum that is nested in this message, with its values from 0.
    Enum {
        name: &'static str,
        values: &'static [&'static str],
    },
}

const DOUBLE: Kind = Kind::Plain(Type::Double);
const FIXED32: Kind = Kind::Plain(Type::Fixed32);
const INT32: Kind = Kind::Plain(Type::Int32);
const INT64: Kind = Kind::Plain(Type::Int64);
const BOOL: Kind = Kind::Plain(Type::Bool);
const BYTES: Kind = Kind::Plain(Type::Bytes);
const STRING: Kind = Kind::Plain(Type::String);
const TIMESTAMP: Kind = Kind::Message("google.protobuf.Timestamp");
const VECTOR3: Kind = Kind::Message("foxglove.Vector3");
const QUATERNION: Kind = Kind::Message("foxglove.Quaternion");
const POSE: Kind = Kind::Message("foxglove.Pose");
const COLOR: Kind = Kind::Message("foxglove.Color");
const NUMERIC_TYPE: Kind = Kind::Enum {
    name: "NumericType",
    values: &[
        "UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64",
    ],
};
const LINE_TYPE: Kind =
    Kind::Enum { name: "Type", values: &["LINE_STRIP", "LINE_LOOP", "LINE_LIST"] };
const DELETION_TYPE: Kind = Kind::Enum { name: "Type", values: &["MATCHING_ID", "ALL"] };

/// Dependencies come before their users, as readers of a descriptor set expect.
const DECLARATIONS: [Declaration; 23] = [
    Declaration {
        package: "google.protobuf",
        name: "Timestamp",
        file: "google/protobuf/timestamp.proto",
        fields: &[("seconds", 1, INT64), ("nanos", 2, INT32)],
    },
    Declaration {
        package: "foxglove",
        name: "Vector3",
        file: "foxglove/Vector3.proto",
        fields: &[("x", 1, DOUBLE), ("y", 2, DOUBLE), ("z", 3, DOUBLE)],
    },
    Declaration {
        package: "foxglove",
        name: "Quaternion",
        file: "foxglove/Quaternion.proto",
        fields: &[("x", 1, DOUBLE), ("y", 2, DOUBLE), ("z", 3, DOUBLE), ("w", 4, DOUBLE)],
    },
    Declaration {
        package: "foxglove",
        name: "Pose",
        file: "foxglove/Pose.proto",
        fields: &[("position", 1, VECTOR3), ("orientation", 2, QUATERNION)],
    },
    Declaration {
        package: "foxglove",
        name: "PackedElementField",
        file: "foxglove/PackedElementField.proto",
        fields: &[("name", 1, STRING), ("offset", 2, FIXED32), ("type", 3, NUMERIC_TYPE)],
    },
    Declaration {
        package: "foxglove",
        name: "PointCloud",
        file: "foxglove/PointCloud.proto",
        fields: &[
            ("timestamp", 1, TIMESTAMP),
            ("frame_id", 2, STRING),
            ("pose", 3, POSE),
            ("point_stride", 4, FIXED32),
            ("fields", 5, Kind::List("foxglove.PackedElementField")),
            ("data", 6, BYTES),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "FrameTransform",
        file: "foxglove/FrameTransform.proto",
        fields: &[
            ("timestamp", 1, TIMESTAMP),
            ("parent_frame_id", 2, STRING),
            ("child_frame_id", 3, STRING),
            ("translation", 4, VECTOR3),
            ("rotation", 5, QUATERNION),
        ],
    },
    Declaration {
        package: "catenary",
        name: "Keyframe",
        file: "catenary/Keyframe.proto",
        fields: &[("step", 1, Kind::Plain(Type::Uint64)), ("data", 2, BYTES)],
    },
    Declaration {
        package: "foxglove",
        name: "Color",
        file: "foxglove/Color.proto",
        fields: &[("r", 1, DOUBLE), ("g", 2, DOUBLE), ("b", 3, DOUBLE), ("a", 4, DOUBLE)],
    },
    Declaration {
        package: "foxglove",
        name: "ArrowPrimitive",
        file: "foxglove/ArrowPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("shaft_length", 2, DOUBLE),
            ("shaft_diameter", 3, DOUBLE),
            ("head_length", 4, DOUBLE),
            ("head_diameter", 5, DOUBLE),
            ("color", 6, COLOR),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "CubePrimitive",
        file: "foxglove/CubePrimitive.proto",
        fields: &[("pose", 1, POSE), ("size", 2, VECTOR3), ("color", 3, COLOR)],
    },
    Declaration {
        package: "foxglove",
        name: "CylinderPrimitive",
        file: "foxglove/CylinderPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("size", 2, VECTOR3),
            ("bottom_scale", 3, DOUBLE),
            ("top_scale", 4, DOUBLE),
            ("color", 5, COLOR),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "KeyValuePair",
        file: "foxglove/KeyValuePair.proto",
        fields: &[("key", 1, STRING), ("value", 2, STRING)],
    },
    Declaration {
        package: "foxglove",
        name: "Point3",
        file: "foxglove/Point3.proto",
        fields: &[("x", 1, DOUBLE), ("y", 2, DOUBLE), ("z", 3, DOUBLE)],
    },
    Declaration {
        package: "foxglove",
        name: "LinePrimitive",
        file: "foxglove/LinePrimitive.proto",
        fields: &[
            ("type", 1, LINE_TYPE),
            ("pose", 2, POSE),
            ("thickness", 3, DOUBLE),
            ("scale_invariant", 4, BOOL),
            ("points", 5, Kind::List("foxglove.Point3")),
            ("color", 6, COLOR),
            ("colors", 7, Kind::List("foxglove.Color")),
            ("indices", 8, Kind::Numbers(Type::Fixed32)),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "ModelPrimitive",
        file: "foxglove/ModelPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("scale", 2, VECTOR3),
            ("color", 3, COLOR),
            ("override_color", 4, BOOL),
            ("url", 5, STRING),
            ("media_type", 6, STRING),
            ("data", 7, BYTES),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "SpherePrimitive",
        file: "foxglove/SpherePrimitive.proto",
        fields: &[("pose", 1, POSE), ("size", 2, VECTOR3), ("color", 3, COLOR)],
    },
    Declaration {
        package: "foxglove",
        name: "TextPrimitive",
        file: "foxglove/TextPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("billboard", 2, BOOL),
            ("font_size", 3, DOUBLE),
            ("scale_invariant", 4, BOOL),
            ("color", 5, COLOR),
            ("text", 6, STRING),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "TriangleListPrimitive",
        file: "foxglove/TriangleListPrimitive.proto",
        fields: &[
            ("pose", 1, POSE),
            ("points", 2, Kind::List("foxglove.Point3")),
            ("color", 3, COLOR),
            ("colors", 4, Kind::List("foxglove.Color")),
            ("indices", 5, Kind::Numbers(Type::Fixed32)),
        ],
    },
    Declaration {
        package: "google.protobuf",
        name: "Duration",
        file: "google/protobuf/duration.proto",
        fields: &[("seconds", 1, INT64), ("nanos", 2, INT32)],
    },
    Declaration {
        package: "foxglove",
        name: "SceneEntity",
        file: "foxglove/SceneEntity.proto",
        fields: &[
            ("timestamp", 1, TIMESTAMP),
            ("frame_id", 2, STRING),
            ("id", 3, STRING),
            ("lifetime", 4, Kind::Message("google.protobuf.Duration")),
            ("frame_locked", 5, BOOL),
            ("metadata", 6, Kind::List("foxglove.KeyValuePair")),
            ("arrows", 7, Kind::List("foxglove.ArrowPrimitive")),
            ("cubes", 8, Kind::List("foxglove.CubePrimitive")),
            ("spheres", 9, Kind::List("foxglove.SpherePrimitive")),
            ("cylinders", 10, Kind::List("foxglove.CylinderPrimitive")),
            ("lines", 11, Kind::List("foxglove.LinePrimitive")),
            ("triangles", 12, Kind::List("foxglove.TriangleListPrimitive")),
            ("texts", 13, Kind::List("foxglove.TextPrimitive")),
            ("models", 14, Kind::List("foxglove.ModelPrimitive")),
        ],
    },
    Declaration {
        package: "foxglove",
        name: "SceneEntityDeletion",
        file: "foxglove/SceneEntityDeletion.proto",
        fields: &[("timestamp", 1, TIMESTAMP), ("type", 2, DELETION_TYPE), ("id", 3, STRING)],
    },
    Declaration {
        package: "foxglove",
        name: "SceneUpdate",
        file: "foxglove/SceneUpdate.proto",
        fields: &[
            ("deletions", 1, Kind::List("foxglove.SceneEntityDeletion")),
            ("entities", 2, Kind::List("foxglove.SceneEntity")),
        ],
    },
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use prost::encoding::{WireType, decode_key, decode_varint};
    use sim_messages::ParticleState;
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
