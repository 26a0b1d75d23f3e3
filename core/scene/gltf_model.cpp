/* SPDX-License-Identifier: Apache-2.0 */
extern "C" {
#include "core/scene/gltf_model.h"

#include "core/base/limits.h"
#include "core/scene/gltf_container.h"
}

#include <fstream> /* tiny_gltf.h forgets it without files */

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_FS
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#include <tiny_gltf.h>

#include <algorithm>
#include <deque>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace
{

using Json = nlohmann::json;

/* Arrays whose places in memory last. */
template <typename T> class Pool
{
      public:
	const T *keep(std::vector<T> &&run)
	{
		runs_.push_back(std::move(run));
		return runs_.back().data();
	}

      private:
	std::deque<std::vector<T>> runs_;
};

/* What tinygltf does not get to see: the bytes of buffers and images. */
struct Embedded {
	std::string name;
	int view = -1;
	bool is_chunk = false; /* the GLB's own */
	size_t size = 0;
	std::vector<unsigned char> bytes;
};

/* What is wrong with the text, for people. */
class Refusal : public std::exception
{
      public:
	explicit Refusal(std::string text, int of = PEN_EINVALID) : code(of), text_(std::move(text))
	{
	}

	const char *what() const noexcept override
	{
		return text_.c_str();
	}

	int code;

      private:
	std::string text_;
};

} // namespace

struct pen_gltf {
	pen_gltf_container container = {};
	tinygltf::Model source;
	std::vector<Embedded> buffers, images;
	pen_gltf_model model = {};
	Pool<pen_gltf_bytes> bytes;
	Pool<pen_gltf_view> views;
	Pool<pen_gltf_accessor> accessors;
	Pool<pen_gltf_attribute> attributes;
	Pool<pen_gltf_attributes> targets;
	Pool<pen_gltf_primitive> primitives;
	Pool<pen_gltf_mesh> meshes;
	Pool<pen_gltf_node> nodes;
	Pool<pen_gltf_indices> scenes;
	Pool<pen_gltf_camera> cameras;
	Pool<pen_gltf_light> lights;
	Pool<pen_gltf_skin> skins;
	Pool<pen_gltf_sampler> samplers;
	Pool<pen_gltf_channel> channels;
	Pool<pen_gltf_animation> animations;
	Pool<pen_gltf_image> pictures;
	Pool<pen_gltf_texture> textures;
	Pool<pen_gltf_material> materials;
	Pool<const char *> texts;
};

/* The value of a base64 digit (RFC 4648, either alphabet); -1: none. */
static int digit_value(char c)
{
	if (c >= 'A' && c <= 'Z')
		return c - 'A';
	if (c >= 'a' && c <= 'z')
		return c - 'a' + 26;
	if (c >= '0' && c <= '9')
		return c - '0' + 52;
	if (c == '+' || c == '-')
		return 62;
	return c == '/' || c == '_' ? 63 : -1;
}

static std::vector<unsigned char> decode_base64(
	const std::string &uri, size_t start, const std::string &place)
{
	std::vector<unsigned char> bytes;
	uint32_t bits = 0;
	int held = 0;
	size_t end = uri.size();

	while (end > start && uri[end - 1] == '=')
		end--;
	bytes.reserve((end - start) / 4 * 3 + 3);
	for (size_t i = start; i < end; i++) {
		const int digit = digit_value(uri[i]);

		if (digit < 0)
			throw Refusal(place + ": its data URI is not base64");
		bits = bits << 6 | static_cast<uint32_t>(digit);
		held += 6;
		if (held >= 8) {
			held -= 8;
			bytes.push_back(static_cast<unsigned char>(bits >> held));
		}
	}
	return bytes;
}

static std::vector<unsigned char> decode_uri(const std::string &uri, const std::string &place)
{
	const size_t comma = uri.find(',');

	if (comma == std::string::npos || comma < 7 || uri.compare(comma - 7, 7, ";base64") != 0)
		throw Refusal(place + ": its data URI is not base64");
	return decode_base64(uri, comma + 1, place);
}

static bool is_data_uri(const std::string &uri)
{
	return uri.compare(0, 5, "data:") == 0;
}

static std::string printable(const std::string &text, size_t most)
{
	std::string shown = text.substr(0, most);

	for (char &c : shown)
		if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
			c = '?';
	return text.size() > most ? shown + "..." : shown;
}

/* All files that the text names, in one refusal. */
static void refuse_files(const Json &text)
{
	std::string names;
	size_t count = 0;

	for (const char *list : {"buffers", "images"}) {
		for (const Json &item : text.value(list, Json::array())) {
			if (!item.is_object() || !item.contains("uri") || !item["uri"].is_string())
				continue;

			const std::string uri = item["uri"].get<std::string>();

			if (is_data_uri(uri) || ++count > 8)
				continue;
			names += (names.empty() ? "" : ", ") + printable(uri, 60);
		}
	}
	if (count > 8)
		names += " and " + std::to_string(count - 8) + " more";
	if (count > 0)
		throw Refusal("it names files beside it (" + names +
			      "), which are not read; export a .glb, or embed them");
}

static int view_of(const Json &image, const std::string &place)
{
	const auto view = image.find("bufferView");

	if (view == image.end() || !view->is_number_unsigned() || view->get<uint64_t>() > INT32_MAX)
		throw Refusal(place + ": it has neither a uri nor a bufferView");
	return view->get<int>();
}

static Embedded image_of(const Json &item, const std::string &place)
{
	Embedded image;

	if (item.contains("name") && item["name"].is_string())
		image.name = item["name"].get<std::string>();
	if (item.contains("uri") && item["uri"].is_string())
		image.bytes = decode_uri(item["uri"].get<std::string>(), place);
	else
		image.view = view_of(item, place);
	image.size = image.bytes.size();
	return image;
}

static Embedded buffer_of(const Json &item, const std::string &place)
{
	const auto length = item.find("byteLength");
	Embedded buffer;

	if (length == item.end() || !length->is_number_unsigned())
		throw Refusal(place + ": byteLength must be a whole number");
	buffer.size = length->get<size_t>();
	if (item.contains("uri") && item["uri"].is_string()) {
		buffer.bytes = decode_uri(item["uri"].get<std::string>(), place);
		if (buffer.bytes.size() < buffer.size)
			throw Refusal(place + ": byteLength is " + std::to_string(buffer.size) +
				      ", but its data URI holds " +
				      std::to_string(buffer.bytes.size()) + " bytes");
	} else {
		buffer.is_chunk = true;
	}
	return buffer;
}

/* Takes a list out of the text. */
template <typename Read>
static std::vector<Embedded> take_list(Json &text, const char *list, const char *word, Read read)
{
	std::vector<Embedded> taken;

	for (const Json &item : text.value(list, Json::array())) {
		const std::string place = word + (" " + std::to_string(taken.size()));

		if (!item.is_object())
			throw Refusal(place + " must be an object");
		taken.push_back(read(item, place));
	}
	text.erase(list);
	return taken;
}

static void check_lists(const Json &text)
{
	for (const char *list : {"accessors", "animations", "buffers", "bufferViews", "cameras",
		     "images", "materials", "meshes", "nodes", "samplers", "scenes", "skins",
		     "textures", "extensionsUsed", "extensionsRequired"}) {
		const auto found = text.find(list);

		if (found == text.end())
			continue;
		if (!found->is_array())
			throw Refusal(std::string(list) + " must be an array");
		if (found->size() > PEN_GLTF_LIST_MAX)
			throw Refusal(std::string(list) + " has more than " +
					      std::to_string(PEN_GLTF_LIST_MAX) + " elements",
				PEN_ELIMIT);
	}
}

/* Before all else is read: such an extension may be the reason why the rest looks broken. */
static void check_required(const Json &text)
{
	for (const Json &item : text.value("extensionsRequired", Json::array())) {
		const std::string name = item.is_string() ? item.get<std::string>() : "";

		if (!pen_gltf_knows(name.c_str()))
			throw Refusal("it requires the extension " + printable(name, 60) +
				      ", which is not supported");
	}
}

static void check_version(const Json &text)
{
	const auto asset = text.find("asset");

	if (asset == text.end() || !asset->is_object() || !asset->contains("version") ||
		!(*asset)["version"].is_string())
		throw Refusal("it is not glTF 2.0: asset.version is missing");

	const std::string version = (*asset)["version"].get<std::string>();

	if (version.compare(0, 2, "2.") != 0)
		throw Refusal("it is glTF of version " + printable(version, 20) +
			      "; only version 2.0 is read");
}

static void check_chunk(const pen_gltf &gltf)
{
	for (size_t i = 0; i < gltf.buffers.size(); i++) {
		const Embedded &buffer = gltf.buffers[i];
		const std::string place = "buffer " + std::to_string(i);

		if (!buffer.is_chunk)
			continue;
		if (i > 0 || !gltf.container.is_binary)
			throw Refusal(place + ": it has no uri, and is not a GLB's first");
		if (buffer.size > gltf.container.chunk_size)
			throw Refusal(place + ": byteLength is " + std::to_string(buffer.size) +
				      ", but the BIN chunk holds " +
				      std::to_string(gltf.container.chunk_size) + " bytes");
	}
}

/* The text without what tinygltf is not to see. */
static std::string prepare(pen_gltf &gltf)
{
	const char *begin = gltf.container.text;
	Json text = Json::parse(begin, begin + gltf.container.text_size, nullptr, false);

	if (text.is_discarded() || !text.is_object())
		throw Refusal("its text is not a JSON object");
	check_version(text);
	check_lists(text);
	check_required(text);
	refuse_files(text);
	gltf.buffers = take_list(text, "buffers", "buffer", buffer_of);
	gltf.images = take_list(text, "images", "image", image_of);
	check_chunk(gltf);
	return text.dump();
}

static void load(pen_gltf &gltf)
{
	const std::string text = prepare(gltf);
	std::string faults, warnings;
	tinygltf::TinyGLTF reader;

	if (!reader.LoadASCIIFromString(&gltf.source, &faults, &warnings, text.c_str(),
		    static_cast<unsigned int>(text.size()), "", tinygltf::NO_REQUIRE)) {
		while (!faults.empty() && faults.back() == '\n')
			faults.pop_back();
		throw Refusal("it is not valid glTF: " + printable(faults, 160));
	}
}

template <typename T> static pen_gltf_numbers numbers(const std::vector<T> &from)
{
	return {from.data(), from.size()};
}

static pen_gltf_indices indices(const std::vector<int> &from)
{
	return {from.data(), from.size()};
}

/* One element of an array of the model for each of the source. */
template <typename T, typename From, typename Convert>
static void fill(
	Pool<T> &pool, const From &from, const T **ret_items, size_t *ret_count, Convert convert)
{
	std::vector<T> items;

	items.reserve(from.size());
	for (const auto &item : from)
		items.push_back(convert(item));
	*ret_count = items.size();
	*ret_items = pool.keep(std::move(items));
}

static const tinygltf::Value *extension(const tinygltf::ExtensionMap &map, const char *name)
{
	const auto found = map.find(name);

	return found != map.end() && found->second.IsObject() ? &found->second : nullptr;
}

static double number(const tinygltf::Value &object, const char *key, double fallback)
{
	const tinygltf::Value &value = object.Get(std::string(key));

	return value.IsNumber() ? value.GetNumberAsDouble() : fallback;
}

static int integer(const tinygltf::Value &object, const char *key, int fallback)
{
	const tinygltf::Value &value = object.Get(std::string(key));

	return value.IsInt() ? value.GetNumberAsInt() : fallback;
}

/* Leaves what is not there, or no array of the size, as it is. */
template <int size>
static void some_numbers(const tinygltf::Value &object, const char *key, double (&ret)[size])
{
	const tinygltf::Value &value = object.Get(std::string(key));

	for (int i = 0; i < size && value.IsArray() && value.ArrayLen() == size; i++)
		if (value.Get(i).IsNumber())
			ret[i] = value.Get(i).GetNumberAsDouble();
}

static pen_gltf_texture_use use_of(int texture, int uv_set, const tinygltf::Value *transform)
{
	pen_gltf_texture_use use = {texture, uv_set, {0.0, 0.0}, 0.0, {1.0, 1.0}};

	if (!transform)
		return use;
	use.uv_set = integer(*transform, "texCoord", uv_set);
	use.rotation = number(*transform, "rotation", 0.0);
	some_numbers(*transform, "offset", use.offset);
	some_numbers(*transform, "scale", use.scale);
	return use;
}

/* Of any of tinygltf's structures for it. */
template <typename Info> static pen_gltf_texture_use use_of(const Info &info)
{
	return use_of(
		info.index, info.texCoord, extension(info.extensions, "KHR_texture_transform"));
}

/* The same within an extension, of which tinygltf keeps a tree. */
static pen_gltf_texture_use use_within(const tinygltf::Value &object, const char *key)
{
	const tinygltf::Value &info = object.Get(std::string(key));

	if (!info.IsObject())
		return use_of(-1, 0, nullptr);

	const tinygltf::Value &extensions = info.Get(std::string("extensions"));
	const tinygltf::Value *transform = nullptr;

	if (extensions.IsObject() && extensions.Has("KHR_texture_transform") &&
		extensions.Get(std::string("KHR_texture_transform")).IsObject())
		transform = &extensions.Get(std::string("KHR_texture_transform"));
	return use_of(integer(info, "index", -1), integer(info, "texCoord", 0), transform);
}

static void add_extensions(const tinygltf::Material &from, pen_gltf_material &to)
{
	static const tinygltf::Value none{tinygltf::Value::Object{}};
	const auto find = [&](const char *name) -> const tinygltf::Value & {
		const tinygltf::Value *value = extension(from.extensions, name);

		return value ? *value : none;
	};
	const tinygltf::Value &clearcoat = find("KHR_materials_clearcoat");
	const tinygltf::Value &specular = find("KHR_materials_specular");
	const tinygltf::Value &transmission = find("KHR_materials_transmission");
	const tinygltf::Value &normal = clearcoat.Get(std::string("clearcoatNormalTexture"));

	std::fill(to.specular_color, to.specular_color + 3, 1.0);
	to.ior = number(find("KHR_materials_ior"), "ior", 1.5);
	to.emissive_strength =
		number(find("KHR_materials_emissive_strength"), "emissiveStrength", 1.0);
	to.transmission = number(transmission, "transmissionFactor", 0.0);
	to.transmission_texture = use_within(transmission, "transmissionTexture");
	to.clearcoat = number(clearcoat, "clearcoatFactor", 0.0);
	to.clearcoat_roughness = number(clearcoat, "clearcoatRoughnessFactor", 0.0);
	to.clearcoat_texture = use_within(clearcoat, "clearcoatTexture");
	to.clearcoat_roughness_texture = use_within(clearcoat, "clearcoatRoughnessTexture");
	to.clearcoat_normal_texture = use_within(clearcoat, "clearcoatNormalTexture");
	to.clearcoat_normal_scale = normal.IsObject() ? number(normal, "scale", 1.0) : 1.0;
	to.specular = number(specular, "specularFactor", 1.0);
	some_numbers(specular, "specularColorFactor", to.specular_color);
	to.specular_texture = use_within(specular, "specularTexture");
	to.specular_color_texture = use_within(specular, "specularColorTexture");
	to.is_unlit = from.extensions.count("KHR_materials_unlit") > 0;
}

static pen_gltf_material material_of(const tinygltf::Material &from)
{
	const tinygltf::PbrMetallicRoughness &pbr = from.pbrMetallicRoughness;
	pen_gltf_material to = {};

	to.name = from.name.c_str();
	to.alpha_mode = from.alphaMode.c_str();
	to.base_color = numbers(pbr.baseColorFactor);
	to.emissive = numbers(from.emissiveFactor);
	to.metallic = pbr.metallicFactor;
	to.roughness = pbr.roughnessFactor;
	to.alpha_cutoff = from.alphaCutoff;
	to.normal_scale = from.normalTexture.scale;
	to.is_double_sided = from.doubleSided;
	to.base_color_texture = use_of(pbr.baseColorTexture);
	to.metallic_roughness_texture = use_of(pbr.metallicRoughnessTexture);
	to.normal_texture = use_of(from.normalTexture);
	to.emissive_texture = use_of(from.emissiveTexture);
	add_extensions(from, to);
	return to;
}

static pen_gltf_accessor accessor_of(const tinygltf::Accessor &from)
{
	pen_gltf_accessor to = {};
	const int width = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(from.type));

	to.view = from.bufferView;
	to.offset = from.byteOffset;
	to.count = from.count;
	to.component = from.componentType;
	to.width = static_cast<uint32_t>(width);
	to.is_matrix = from.type == TINYGLTF_TYPE_MAT2 || from.type == TINYGLTF_TYPE_MAT3 ||
		       from.type == TINYGLTF_TYPE_MAT4;
	to.normalized = from.normalized;
	to.is_sparse = from.sparse.isSparse;
	if (to.is_sparse) {
		to.sparse_count = from.sparse.count;
		to.index_view = from.sparse.indices.bufferView;
		to.index_offset = from.sparse.indices.byteOffset;
		to.index_component = from.sparse.indices.componentType;
		to.value_view = from.sparse.values.bufferView;
		to.value_offset = from.sparse.values.byteOffset;
	}
	return to;
}

static void fill_storage(pen_gltf &gltf)
{
	const pen_gltf_container &container = gltf.container;
	pen_gltf_model &m = gltf.model;

	fill(gltf.bytes, gltf.buffers, &m.buffers, &m.buffer_count, [&](const Embedded &from) {
		if (!from.is_chunk)
			return pen_gltf_bytes{from.bytes.data(), from.size, SIZE_MAX};
		return pen_gltf_bytes{container.chunk, from.size, container.chunk_offset};
	});
	fill(gltf.views, gltf.source.bufferViews, &m.views, &m.view_count,
		[](const tinygltf::BufferView &from) {
			return pen_gltf_view{
				from.buffer, from.byteOffset, from.byteLength, from.byteStride};
		});
	fill(gltf.accessors, gltf.source.accessors, &m.accessors, &m.accessor_count, accessor_of);
	fill(gltf.pictures, gltf.images, &m.images, &m.image_count, [](const Embedded &from) {
		return pen_gltf_image{from.name.c_str(), from.view, from.bytes.data(), from.size};
	});
}

static pen_gltf_attributes attributes_of(pen_gltf &gltf, const std::map<std::string, int> &from)
{
	pen_gltf_attributes to = {};

	fill(gltf.attributes, from, &to.items, &to.count, [](const auto &item) {
		return pen_gltf_attribute{item.first.c_str(), item.second};
	});
	return to;
}

static pen_gltf_primitive primitive_of(pen_gltf &gltf, const tinygltf::Primitive &from)
{
	pen_gltf_primitive to = {};

	to.attributes = attributes_of(gltf, from.attributes);
	fill(gltf.targets, from.targets, &to.targets, &to.target_count,
		[&](const std::map<std::string, int> &target) {
			return attributes_of(gltf, target);
		});
	to.indices = from.indices;
	to.material = from.material;
	to.mode = from.mode;
	return to;
}

static pen_gltf_node node_of(const tinygltf::Node &from)
{
	const tinygltf::Value *light = extension(from.extensions, "KHR_lights_punctual");
	pen_gltf_node to = {};

	to.name = from.name.c_str();
	to.mesh = from.mesh;
	to.skin = from.skin;
	to.camera = from.camera;
	to.light = light ? integer(*light, "light", -1) : -1;
	to.children = indices(from.children);
	to.matrix = numbers(from.matrix);
	to.translation = numbers(from.translation);
	to.rotation = numbers(from.rotation);
	to.scale = numbers(from.scale);
	to.weights = numbers(from.weights);
	return to;
}

static void fill_tree(pen_gltf &gltf)
{
	pen_gltf_model &m = gltf.model;

	fill(gltf.meshes, gltf.source.meshes, &m.meshes, &m.mesh_count,
		[&](const tinygltf::Mesh &from) {
			pen_gltf_mesh to = {};

			to.name = from.name.c_str();
			to.weights = numbers(from.weights);
			fill(gltf.primitives, from.primitives, &to.primitives, &to.primitive_count,
				[&](const tinygltf::Primitive &primitive) {
					return primitive_of(gltf, primitive);
				});
			return to;
		});
	fill(gltf.nodes, gltf.source.nodes, &m.nodes, &m.node_count, node_of);
	fill(gltf.scenes, gltf.source.scenes, &m.scenes, &m.scene_count,
		[](const tinygltf::Scene &from) { return indices(from.nodes); });
	fill(gltf.skins, gltf.source.skins, &m.skins, &m.skin_count,
		[](const tinygltf::Skin &from) {
			return pen_gltf_skin{
				from.name.c_str(), from.inverseBindMatrices, indices(from.joints)};
		});
	m.default_scene = gltf.source.defaultScene;
	m.generator = gltf.source.asset.generator.c_str();
}

static pen_gltf_animation animation_of(pen_gltf &gltf, const tinygltf::Animation &from)
{
	pen_gltf_animation to = {};

	to.name = from.name.c_str();
	fill(gltf.samplers, from.samplers, &to.samplers, &to.sampler_count,
		[](const tinygltf::AnimationSampler &sampler) {
			return pen_gltf_sampler{
				sampler.input, sampler.output, sampler.interpolation.c_str()};
		});
	fill(gltf.channels, from.channels, &to.channels, &to.channel_count,
		[](const tinygltf::AnimationChannel &channel) {
			return pen_gltf_channel{
				channel.sampler, channel.target_node, channel.target_path.c_str()};
		});
	return to;
}

static pen_gltf_light light_of(const tinygltf::Light &from)
{
	return {from.name.c_str(), from.type.c_str(), numbers(from.color), from.intensity,
		from.spot.innerConeAngle, from.spot.outerConeAngle};
}

static void fill_looks(pen_gltf &gltf)
{
	const std::vector<tinygltf::Sampler> &samplers = gltf.source.samplers;
	pen_gltf_model &m = gltf.model;

	fill(gltf.cameras, gltf.source.cameras, &m.cameras, &m.camera_count,
		[](const tinygltf::Camera &from) {
			return pen_gltf_camera{from.name.c_str(), from.type == "orthographic",
				from.perspective.yfov, from.orthographic.ymag};
		});
	fill(gltf.lights, gltf.source.lights, &m.lights, &m.light_count, light_of);
	fill(gltf.animations, gltf.source.animations, &m.animations, &m.animation_count,
		[&](const tinygltf::Animation &from) { return animation_of(gltf, from); });
	fill(gltf.textures, gltf.source.textures, &m.textures, &m.texture_count,
		[&](const tinygltf::Texture &from) {
			const bool found = from.sampler >= 0 &&
					   static_cast<size_t>(from.sampler) < samplers.size();
			const tinygltf::Sampler sampler =
				found ? samplers[static_cast<size_t>(from.sampler)]
				      : tinygltf::Sampler();

			return pen_gltf_texture{
				from.source, sampler.wrapS, sampler.wrapT, sampler.magFilter};
		});
	fill(gltf.materials, gltf.source.materials, &m.materials, &m.material_count, material_of);
	const auto text_of = [](const std::string &text) { return text.c_str(); };
	fill(gltf.texts, gltf.source.extensionsUsed, &m.used, &m.used_count, text_of);
	fill(gltf.texts, gltf.source.extensionsRequired, &m.required, &m.required_count, text_of);
}

int pen_gltf_create(
	const void *bytes, size_t size, struct pen_gltf **ret_gltf, struct pen_error *err)
{
	try {
		auto gltf = std::make_unique<pen_gltf>();
		const int r = pen_gltf_container_open(bytes, size, &gltf->container, err);

		if (r < 0)
			return r;
		load(*gltf);
		fill_storage(*gltf);
		fill_tree(*gltf);
		fill_looks(*gltf);
		*ret_gltf = gltf.release();
		return 0;
	} catch (const Refusal &refusal) {
		return pen_error_set(err, refusal.code, "%s", refusal.what());
	} catch (const std::bad_alloc &) {
		return pen_error_memory(err);
	} catch (const std::exception &) {
		return pen_error_set(err, PEN_EINVALID, "it is not valid glTF");
	}
}

void pen_gltf_destroy(struct pen_gltf *gltf)
{
	delete gltf;
}

const struct pen_gltf_model *pen_gltf_content(const struct pen_gltf *gltf)
{
	return &gltf->model;
}
