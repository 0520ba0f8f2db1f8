//! What the objects of a document may hold: the property tables of glTF 2.0 and of the extensions that are
//! read.

use crate::gltf::schema::Kind::{
    Above, Any, AttributeLists, Attributes, Codes, Flag, Index, Indices, List, Number, Numbers, Object, Text,
    Whole, Words,
};
use crate::gltf::schema::{Field, Kind, Presence, Schema};
use std::f64::consts::{FRAC_PI_2, PI};

const MOST: f64 = f64::MAX;

const fn free(name: &'static str, kind: Kind) -> Field {
    Field { name, kind, presence: Presence::Free }
}

const fn needed(name: &'static str, kind: Kind) -> Field {
    Field { name, kind, presence: Presence::Needed }
}

const fn plain(fields: &'static [Field]) -> Schema {
    Schema { fields, extensions: &[] }
}

const UNIT: Kind = Number(0.0, 1.0);
const COLOUR: Kind = Numbers(&[3], 0.0, 1.0);

pub(crate) static ROOT: Schema = Schema {
    fields: &[
        needed("asset", Object(&ASSET)),
        free("scene", Index("/scenes")),
        free("scenes", List(&SCENE)),
        free("nodes", List(&NODE)),
        free("meshes", List(&MESH)),
        free("accessors", List(&ACCESSOR)),
        free("bufferViews", List(&BUFFER_VIEW)),
        free("buffers", List(&BUFFER)),
        free("materials", List(&MATERIAL)),
        free("textures", List(&TEXTURE)),
        free("images", List(&IMAGE)),
        free("samplers", List(&SAMPLER)),
        free("cameras", List(&CAMERA)),
        free("skins", List(&SKIN)),
        free("animations", List(&ANIMATION)),
    ],
    extensions: &[
        ("EXT_lights_image_based", &IMAGE_BASED_LIGHTS),
        ("KHR_lights_punctual", &LIGHTS),
        ("KHR_materials_variants", &VARIANTS),
    ],
};

static ASSET: Schema = plain(&[needed("version", Text), free("minVersion", Text)]);

static SCENE: Schema = Schema {
    fields: &[free("name", Text), free("nodes", Indices("/nodes"))],
    extensions: &[("EXT_lights_image_based", &IMAGE_BASED_LIGHT_OF_SCENE)],
};

static IMAGE_BASED_LIGHT_OF_SCENE: Schema = plain(&[needed("light", Whole(0))]);

static IMAGE_BASED_LIGHTS: Schema = plain(&[needed("lights", List(&IMAGE_BASED_LIGHT))]);

static IMAGE_BASED_LIGHT: Schema = plain(&[
    free("name", Text),
    free("intensity", Number(0.0, MOST)),
    free("rotation", Numbers(&[4], -1.0, 1.0)),
    needed("irradianceCoefficients", Any),
    needed("specularImages", Any),
    needed("specularImageSize", Whole(1)),
]);

static NODE: Schema = Schema {
    fields: &[
        free("name", Text),
        free("children", Indices("/nodes")),
        free("mesh", Index("/meshes")),
        free("camera", Index("/cameras")),
        free("skin", Index("/skins")),
        free("matrix", Numbers(&[16], -MOST, MOST)),
        free("translation", Numbers(&[3], -MOST, MOST)),
        free("rotation", Numbers(&[4], -1.0, 1.0)),
        free("scale", Numbers(&[3], -MOST, MOST)),
        free("weights", Numbers(&[], -MOST, MOST)),
    ],
    extensions: &[("EXT_mesh_gpu_instancing", &INSTANCING), ("KHR_lights_punctual", &LIGHT_OF_NODE)],
};

static INSTANCING: Schema = plain(&[needed("attributes", Attributes)]);

static MESH: Schema = plain(&[
    free("name", Text),
    needed("primitives", List(&PRIMITIVE)),
    free("weights", Numbers(&[], -MOST, MOST)),
]);

static PRIMITIVE: Schema = Schema {
    fields: &[
        needed("attributes", Attributes),
        free("indices", Index("/accessors")),
        free("material", Index("/materials")),
        free("mode", Codes(&[0, 1, 2, 3, 4, 5, 6])),
        free("targets", AttributeLists),
    ],
    extensions: &[("KHR_materials_variants", &VARIANTS_OF_PRIMITIVE)],
};

static ACCESSOR: Schema = plain(&[
    needed("componentType", Codes(&[5120, 5121, 5122, 5123, 5125, 5126])),
    needed("count", Whole(1)),
    needed("type", Words(&["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"])),
    free("bufferView", Index("/bufferViews")),
    free("byteOffset", Whole(0)),
    free("normalized", Flag),
    free("sparse", Object(&SPARSE)),
]);

static SPARSE: Schema = plain(&[
    needed("count", Whole(1)),
    needed("indices", Object(&SPARSE_INDICES)),
    needed("values", Object(&SPARSE_VALUES)),
]);

static SPARSE_INDICES: Schema = plain(&[
    needed("bufferView", Index("/bufferViews")),
    free("byteOffset", Whole(0)),
    needed("componentType", Codes(&[5121, 5123, 5125])),
]);

static SPARSE_VALUES: Schema =
    plain(&[needed("bufferView", Index("/bufferViews")), free("byteOffset", Whole(0))]);

static BUFFER_VIEW: Schema = plain(&[
    needed("buffer", Index("/buffers")),
    free("byteOffset", Whole(0)),
    needed("byteLength", Whole(1)),
    free("byteStride", Whole(4)),
]);

static BUFFER: Schema = plain(&[needed("byteLength", Whole(1)), free("uri", Text)]);

static MATERIAL: Schema = Schema {
    fields: &[
        free("name", Text),
        free("pbrMetallicRoughness", Object(&PBR)),
        free("normalTexture", Object(&NORMAL_TEXTURE)),
        free("occlusionTexture", Object(&OCCLUSION_TEXTURE)),
        free("emissiveTexture", Object(&TEXTURE_INFO)),
        free("emissiveFactor", COLOUR),
        free("alphaMode", Words(&["OPAQUE", "MASK", "BLEND"])),
        free("alphaCutoff", Number(0.0, MOST)),
        free("doubleSided", Flag),
    ],
    extensions: &[
        ("KHR_materials_anisotropy", &ANISOTROPY),
        ("KHR_materials_clearcoat", &CLEARCOAT),
        ("KHR_materials_diffuse_transmission", &DIFFUSE_TRANSMISSION),
        ("KHR_materials_dispersion", &DISPERSION),
        ("KHR_materials_emissive_strength", &EMISSIVE_STRENGTH),
        ("KHR_materials_ior", &IOR),
        ("KHR_materials_iridescence", &IRIDESCENCE),
        ("KHR_materials_pbrSpecularGlossiness", &SPECULAR_GLOSSINESS),
        ("KHR_materials_sheen", &SHEEN),
        ("KHR_materials_specular", &SPECULAR),
        ("KHR_materials_transmission", &TRANSMISSION),
        ("KHR_materials_unlit", &UNLIT),
        ("KHR_materials_volume", &VOLUME),
    ],
};

static PBR: Schema = plain(&[
    free("baseColorFactor", Numbers(&[4], 0.0, 1.0)),
    free("baseColorTexture", Object(&TEXTURE_INFO)),
    free("metallicFactor", UNIT),
    free("roughnessFactor", UNIT),
    free("metallicRoughnessTexture", Object(&TEXTURE_INFO)),
]);

static ANISOTROPY: Schema = plain(&[
    free("anisotropyStrength", UNIT),
    free("anisotropyRotation", Number(-MOST, MOST)),
    free("anisotropyTexture", Object(&TEXTURE_INFO)),
]);

static CLEARCOAT: Schema = plain(&[
    free("clearcoatFactor", UNIT),
    free("clearcoatTexture", Object(&TEXTURE_INFO)),
    free("clearcoatRoughnessFactor", UNIT),
    free("clearcoatRoughnessTexture", Object(&TEXTURE_INFO)),
    free("clearcoatNormalTexture", Object(&NORMAL_TEXTURE)),
]);

static DIFFUSE_TRANSMISSION: Schema = plain(&[
    free("diffuseTransmissionFactor", UNIT),
    free("diffuseTransmissionTexture", Object(&TEXTURE_INFO)),
    free("diffuseTransmissionColorFactor", COLOUR),
    free("diffuseTransmissionColorTexture", Object(&TEXTURE_INFO)),
]);

static DISPERSION: Schema = plain(&[free("dispersion", Number(0.0, MOST))]);

static IRIDESCENCE: Schema = plain(&[
    free("iridescenceFactor", UNIT),
    free("iridescenceTexture", Object(&TEXTURE_INFO)),
    free("iridescenceIor", Number(1.0, MOST)),
    free("iridescenceThicknessMinimum", Number(0.0, MOST)),
    free("iridescenceThicknessMaximum", Number(0.0, MOST)),
    free("iridescenceThicknessTexture", Object(&TEXTURE_INFO)),
]);

static SHEEN: Schema = plain(&[
    free("sheenColorFactor", COLOUR),
    free("sheenColorTexture", Object(&TEXTURE_INFO)),
    free("sheenRoughnessFactor", UNIT),
    free("sheenRoughnessTexture", Object(&TEXTURE_INFO)),
]);

static EMISSIVE_STRENGTH: Schema = plain(&[free("emissiveStrength", Number(0.0, MOST))]);

static IOR: Schema = plain(&[free("ior", Number(0.0, MOST))]);

static SPECULAR: Schema = plain(&[
    free("specularFactor", UNIT),
    free("specularTexture", Object(&TEXTURE_INFO)),
    free("specularColorFactor", Numbers(&[3], 0.0, MOST)),
    free("specularColorTexture", Object(&TEXTURE_INFO)),
]);

static SPECULAR_GLOSSINESS: Schema = plain(&[
    free("diffuseFactor", Numbers(&[4], 0.0, 1.0)),
    free("diffuseTexture", Object(&TEXTURE_INFO)),
    free("specularFactor", COLOUR),
    free("glossinessFactor", UNIT),
    free("specularGlossinessTexture", Object(&TEXTURE_INFO)),
]);

static UNLIT: Schema = plain(&[]);

static TRANSMISSION: Schema =
    plain(&[free("transmissionFactor", UNIT), free("transmissionTexture", Object(&TEXTURE_INFO))]);

static VOLUME: Schema = plain(&[
    free("thicknessFactor", Number(0.0, MOST)),
    free("thicknessTexture", Object(&TEXTURE_INFO)),
    free("attenuationDistance", Above(0.0, MOST)),
    free("attenuationColor", COLOUR),
]);

static TEXTURE_INFO: Schema = Schema {
    fields: &[needed("index", Index("/textures")), free("texCoord", Whole(0))],
    extensions: &[("KHR_texture_transform", &TEXTURE_TRANSFORM)],
};

static NORMAL_TEXTURE: Schema = Schema {
    fields: &[
        needed("index", Index("/textures")),
        free("texCoord", Whole(0)),
        free("scale", Number(-MOST, MOST)),
    ],
    extensions: &[("KHR_texture_transform", &TEXTURE_TRANSFORM)],
};

static OCCLUSION_TEXTURE: Schema = Schema {
    fields: &[needed("index", Index("/textures")), free("texCoord", Whole(0)), free("strength", UNIT)],
    extensions: &[("KHR_texture_transform", &TEXTURE_TRANSFORM)],
};

static TEXTURE_TRANSFORM: Schema = plain(&[
    free("offset", Numbers(&[2], -MOST, MOST)),
    free("rotation", Number(-MOST, MOST)),
    free("scale", Numbers(&[2], -MOST, MOST)),
    free("texCoord", Whole(0)),
]);

static TEXTURE: Schema = Schema {
    fields: &[free("sampler", Index("/samplers")), free("source", Index("/images"))],
    extensions: &[("EXT_texture_webp", &TEXTURE_SOURCE)],
};

static TEXTURE_SOURCE: Schema = plain(&[free("source", Index("/images"))]);

static IMAGE: Schema =
    plain(&[free("uri", Text), free("mimeType", Text), free("bufferView", Index("/bufferViews"))]);

static SAMPLER: Schema = plain(&[
    free("magFilter", Codes(&[9728, 9729])),
    free("minFilter", Codes(&[9728, 9729, 9984, 9985, 9986, 9987])),
    free("wrapS", Codes(&[33071, 33648, 10497])),
    free("wrapT", Codes(&[33071, 33648, 10497])),
]);

static CAMERA: Schema = plain(&[
    free("name", Text),
    needed("type", Words(&["perspective", "orthographic"])),
    free("perspective", Object(&PERSPECTIVE)),
    free("orthographic", Object(&ORTHOGRAPHIC)),
]);

static PERSPECTIVE: Schema = plain(&[
    needed("yfov", Above(0.0, PI)),
    needed("znear", Above(0.0, MOST)),
    free("zfar", Above(0.0, MOST)),
    free("aspectRatio", Above(0.0, MOST)),
]);

static ORTHOGRAPHIC: Schema = plain(&[
    needed("xmag", Number(-MOST, MOST)),
    needed("ymag", Number(-MOST, MOST)),
    needed("znear", Number(0.0, MOST)),
    needed("zfar", Above(0.0, MOST)),
]);

static SKIN: Schema = plain(&[
    needed("joints", Indices("/nodes")),
    free("skeleton", Index("/nodes")),
    free("inverseBindMatrices", Index("/accessors")),
]);

static ANIMATION: Schema =
    plain(&[needed("channels", List(&CHANNEL)), needed("samplers", List(&ANIMATION_SAMPLER))]);

static CHANNEL: Schema = plain(&[needed("sampler", Whole(0)), needed("target", Object(&ANIMATION_TARGET))]);

static ANIMATION_TARGET: Schema = plain(&[free("node", Index("/nodes")), needed("path", Text)]);

static ANIMATION_SAMPLER: Schema = plain(&[
    needed("input", Index("/accessors")),
    needed("output", Index("/accessors")),
    free("interpolation", Words(&["LINEAR", "STEP", "CUBICSPLINE"])),
]);

static LIGHTS: Schema = plain(&[needed("lights", List(&LIGHT))]);

static LIGHT: Schema = plain(&[
    free("name", Text),
    needed("type", Words(&["directional", "point", "spot"])),
    free("color", COLOUR),
    free("intensity", Number(0.0, MOST)),
    free("range", Above(0.0, MOST)),
    free("spot", Object(&SPOT)),
]);

static SPOT: Schema =
    plain(&[free("innerConeAngle", Number(0.0, FRAC_PI_2)), free("outerConeAngle", Above(0.0, FRAC_PI_2))]);

static LIGHT_OF_NODE: Schema = plain(&[needed("light", Index("/extensions/KHR_lights_punctual/lights"))]);

static VARIANTS: Schema = plain(&[needed("variants", List(&VARIANT))]);

static VARIANT: Schema = plain(&[needed("name", Text)]);

static VARIANTS_OF_PRIMITIVE: Schema = plain(&[needed("mappings", List(&MAPPING))]);

static MAPPING: Schema = plain(&[
    needed("material", Index("/materials")),
    needed("variants", Indices("/extensions/KHR_materials_variants/variants")),
    free("name", Any),
]);
