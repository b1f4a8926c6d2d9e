#include "engine/assets/color_space.h"

#include <OpenColorIO/OpenColorIO.h>

#include <set>

namespace OCIO = OCIO_NAMESPACE;

namespace lambent {
namespace {

const std::set<std::string>& data_names() {
  static const std::set<std::string> names{"Non-Color", "Non-Colour Data", "Raw",         "raw",
                                           "data",      "Generic Data",    "NoConversion"};
  return names;
}
const std::set<std::string>& linear_names() {
  static const std::set<std::string> names{
      "Linear",   "linear",          "Linear Rec.709", "scene_linear",       "Linear BT.709", "Linear Rec.709 (sRGB)",
      "lin_srgb", "lin_rec709_srgb", "Linear sRGB",    "Linear BT.709 I-D65"};
  return names;
}
const std::set<std::string>& srgb_names() {
  static const std::set<std::string> names{"sRGB", "srgb", "GammaCorrected", "sRGB OETF", "sRGB - Texture"};
  return names;
}

// Linear spaces with other primaries: rows to Rec. 709 with D65 (matrices from the primaries' chromaticities; ACES
// spaces adapted from D60 by Bradford's transform).
struct MatrixSpace {
  const char* name;
  std::array<float, 9> rows;
};
constexpr std::array<float, 9> k_ap0 = {2.52168619f,  -1.13413099f, -0.38755520f, -0.27647991f, 1.37271909f,
                                        -0.09623917f, -0.01537806f, -0.15297534f, 1.16835340f};
constexpr std::array<float, 9> k_ap1 = {1.70505099f,  -0.62179212f, -0.08325887f, -0.13025642f, 1.14080474f,
                                        -0.01054832f, -0.02400336f, -0.12896898f, 1.15297233f};
constexpr std::array<float, 9> k_rec2020 = {1.66049100f,  -0.58764114f, -0.07284986f, -0.12455047f, 1.13289990f,
                                            -0.00834942f, -0.01815076f, -0.10057890f, 1.11872966f};
constexpr std::array<float, 9> k_p3 = {1.22494018f, -0.22494018f, 0.0f,         -0.04205695f, 1.04205695f,
                                       0.0f,        -0.01963755f, -0.07863605f, 1.09827360f};
constexpr std::array<float, 9> k_xyz_d65 = {3.24096994f, -1.53738318f, -0.49861076f, -0.96924364f, 1.87596750f,
                                            0.04155506f, 0.05563008f,  -0.20397696f, 1.05697151f};
constexpr MatrixSpace k_matrix_spaces[] = {
    {"Linear ACES", k_ap0},
    {"ACES2065-1", k_ap0},
    {"Linear ACEScg", k_ap1},
    {"ACEScg", k_ap1},
    {"Linear Rec.2020", k_rec2020},
    {"Linear BT.2020", k_rec2020},
    {"Linear DCI-P3 D65", k_p3},
    {"Linear P3-D65", k_p3},
    {"XYZ", k_xyz_d65},
    {"Linear CIE-XYZ D65", k_xyz_d65},
};

class MatrixTransform : public ColorConversion::Transform {
 public:
  explicit MatrixTransform(const std::array<float, 9>& rows) : m_(rows) {}
  void apply(float* rgb, size_t n, int stride) const override {
    for (size_t i = 0; i < n; ++i, rgb += stride) {
      const float r = rgb[0], g = rgb[1], b = rgb[2];
      for (int k = 0; k < 3; ++k) rgb[k] = m_[3 * k] * r + m_[3 * k + 1] * g + m_[3 * k + 2] * b;
    }
  }

 private:
  std::array<float, 9> m_;
};

// A power curve for Rec.1886-like displays.
class GammaTransform : public ColorConversion::Transform {
 public:
  explicit GammaTransform(float gamma) : gamma_(gamma) {}
  void apply(float* rgb, size_t n, int stride) const override {
    for (size_t i = 0; i < n; ++i, rgb += stride)
      for (int k = 0; k < 3; ++k) rgb[k] = rgb[k] > 0.0f ? std::pow(rgb[k], gamma_) : rgb[k];
  }

 private:
  float gamma_;
};

class OcioTransform : public ColorConversion::Transform {
 public:
  explicit OcioTransform(OCIO::ConstCPUProcessorRcPtr processor) : processor_(std::move(processor)) {}
  void apply(float* rgb, size_t n, int stride) const override {
    OCIO::PackedImageDesc image(rgb, static_cast<long>(n), 1, 3, OCIO::BIT_DEPTH_F32, sizeof(float),
                                stride * static_cast<ptrdiff_t>(sizeof(float)), OCIO::AutoStride);
    processor_->apply(image);
  }

 private:
  OCIO::ConstCPUProcessorRcPtr processor_;
};

}  // namespace

float linear_from_srgb(float encoded) {
  if (encoded <= 0.04045f) return encoded / 12.92f;
  return std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

float srgb_from_linear(float linear) {
  if (linear <= 0.0031308f) return linear * 12.92f;
  return 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float linear_from_srgb_fast(float encoded) {
  constexpr int k_cells = 2048;
  static const std::array<float, k_cells + 1> table = [] {
    std::array<float, k_cells + 1> values{};
    for (int i = 0; i <= k_cells; ++i) values[i] = linear_from_srgb(static_cast<float>(i) / k_cells);
    return values;
  }();
  if (!(encoded > 0.0f && encoded < 1.0f)) return linear_from_srgb(encoded);
  const float scaled = encoded * k_cells;
  const int cell = static_cast<int>(scaled);
  return lerp(table[cell], table[cell + 1], scaled - cell);
}

namespace {

using Rows = std::array<float, 9>;

// Rows of the matrix whose columns are what `convert` makes, in place, of these; none if it is the identity to within
// `tolerance`.
template <typename Convert>
std::optional<Rows> matrix_of(std::array<std::array<float, 3>, 3> columns, float tolerance, Convert&& convert) {
  Rows rows{};
  bool same = true;
  for (size_t k = 0; k < 3; ++k) {
    convert(columns[k].data());
    for (size_t row = 0; row < 3; ++row) {
      rows[3 * row + k] = columns[k][row];
      same = same && std::fabs(columns[k][row] - (row == k ? 1.0f : 0.0f)) < tolerance;
    }
  }
  if (same) return std::nullopt;
  return rows;
}

// Rows of the matrix from linear Rec. 709 to scene-linear, and the former's name; none if they are the same, or a
// configuration does not know Rec. 709.
std::optional<Rows> matrix_from_rec709(const OCIO::Config& config, std::string& name) {
  for (const char* candidate : {"Linear Rec.709", "Linear BT.709", "Linear Rec.709 (sRGB)", "lin_rec709", "Linear"})
    if (name.empty() && config.getColorSpace(candidate)) name = candidate;
  if (name.empty() || !config.hasRole(OCIO::ROLE_SCENE_LINEAR)) return std::nullopt;
  const auto scene_from_rec709 = config.getProcessor(name.c_str(), OCIO::ROLE_SCENE_LINEAR)->getDefaultCPUProcessor();
  return matrix_of({{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 1e-4f,
                   [&](float* column) { scene_from_rec709->applyRGB(column); });
}

// Rows of the matrix for ColorSpaces::scene_from_computed(); none if nothing changes, `otherwise` if the configuration
// does not say.
std::optional<Rows> matrix_from_computed(const OCIO::Config& config, const std::optional<Rows>& otherwise) {
  constexpr const char* k_role = "aces_interchange";
  if (!config.hasRole(k_role) || !config.hasRole(OCIO::ROLE_SCENE_LINEAR)) return otherwise;
  const OCIO::BuiltinTransformRcPtr to_aces = OCIO::BuiltinTransform::Create();
  to_aces->setStyle("UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD");
  to_aces->setDirection(OCIO::TRANSFORM_DIR_INVERSE);
  const auto aces_from_xyz = config.getProcessor(to_aces)->getDefaultCPUProcessor();
  const auto scene_from_aces = config.getProcessor(k_role, OCIO::ROLE_SCENE_LINEAR)->getDefaultCPUProcessor();
  // XYZ of Rec. 709's primaries, the inverse of rec709_from_xyz().
  constexpr std::array<std::array<float, 3>, 3> k_xyz{{{0.4124564f, 0.2126729f, 0.0193339f},
                                                       {0.3575761f, 0.7151522f, 0.1191920f},
                                                       {0.1804375f, 0.0721750f, 0.9503041f}}};
  return matrix_of(k_xyz, 3e-5f, [&](float* column) {
    aces_from_xyz->applyRGB(column);
    scene_from_aces->applyRGB(column);
  });
}

}  // namespace

struct ColorSpaces::Config {
  OCIO::ConstConfigRcPtr ocio;
};

ColorSpaces::ColorSpaces(const std::string& ocio_config, const std::string& working_space)
    : config_(std::make_unique<Config>()) {
  if (ocio_config.empty()) return;
  try {
    config_->ocio = OCIO::Config::CreateFromFile(ocio_config.c_str());
    if (!working_space.empty() && !config_->ocio->getColorSpace(working_space.c_str())) {
      error_ = "The OpenColorIO configuration '" + ocio_config + "' has no working space '" + working_space +
               "'; colours are taken to be in its scene_linear one";
    } else if (!working_space.empty()) {
      const OCIO::ConfigRcPtr changed = config_->ocio->createEditableCopy();
      changed->setRole(OCIO::ROLE_SCENE_LINEAR, working_space.c_str());
      config_->ocio = changed;
    }
    scene_from_rec709_ = matrix_from_rec709(*config_->ocio, rec709_name_);
    scene_from_computed_ = matrix_from_computed(*config_->ocio, scene_from_rec709_);
  } catch (const OCIO::Exception& exception) {
    error_ = "The OpenColorIO configuration '" + ocio_config +
             "' could not be read; built-in colour spaces are used: " + exception.what();
  }
}
ColorSpaces::~ColorSpaces() = default;

ColorConversion ColorSpaces::find(const std::string& given, bool file_is_float) const {
  ColorConversion conversion;
  std::string name = given;
  if (scene_from_rec709_) {  // Names below mean spaces of Rec. 709's primaries
    if (srgb_names().contains(name) || (name.empty() && !file_is_float)) name = "sRGB";
    if (name != "scene_linear" && linear_names().contains(name)) name = rec709_name_;
  }
  const bool built_in = !scene_from_rec709_ || !config_->ocio->getColorSpace(name.c_str());
  if (name.empty()) {
    conversion.kind = file_is_float ? ColorConversion::Kind::none : ColorConversion::Kind::srgb;
    return conversion;
  }
  if (built_in && srgb_names().contains(name)) {
    conversion.kind = ColorConversion::Kind::srgb;
    return conversion;
  }
  if (data_names().contains(name)) {
    conversion.is_data = true;
    return conversion;
  }
  if (built_in && linear_names().contains(name)) return conversion;
  if (config_->ocio) {
    try {
      const OCIO::ConstColorSpaceRcPtr space = config_->ocio->getColorSpace(name.c_str());
      if (space) {
        if (space->isData()) {
          conversion.is_data = true;
          return conversion;
        }
        const OCIO::ConstProcessorRcPtr processor = config_->ocio->getProcessor(name.c_str(), OCIO::ROLE_SCENE_LINEAR);
        if (processor->isNoOp()) return conversion;
        conversion.kind = ColorConversion::Kind::apply;
        conversion.transform = std::make_shared<OcioTransform>(processor->getDefaultCPUProcessor());
        return conversion;
      }
    } catch (const OCIO::Exception& exception) {
      conversion.warning = "colour space '" + name + "' failed in OpenColorIO (" + exception.what() + ")";
    }
  }
  for (const MatrixSpace& space : k_matrix_spaces)
    if (name == space.name) {
      conversion.kind = ColorConversion::Kind::apply;
      conversion.transform = std::make_shared<MatrixTransform>(space.rows);
      conversion.warning.clear();
      return conversion;
    }
  if (name == "Rec.1886" || name == "nuke_rec709" || name == "Gamma 2.4 Encoded Rec.709") {
    conversion.kind = ColorConversion::Kind::apply;
    conversion.transform = std::make_shared<GammaTransform>(name == "nuke_rec709" ? 1.0f / 0.45f : 2.4f);
    conversion.warning.clear();
    return conversion;
  }
  if (conversion.warning.empty())
    conversion.warning =
        "colour space '" + name + "' is not known" + (config_->ocio ? "" : " without an OpenColorIO configuration");
  conversion.warning += file_is_float ? "; its values are taken as scene-linear" : "; it is taken as sRGB";
  conversion.kind = file_is_float ? ColorConversion::Kind::none : ColorConversion::Kind::srgb;
  return conversion;
}

}  // namespace lambent
