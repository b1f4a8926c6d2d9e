// Names of enumerations on the wire.
#pragma once

#include <string_view>
#include <utility>

#include "engine/description/description.h"

namespace lambent::description {

template <typename T>
using Choice = std::pair<std::string_view, T>;

inline constexpr Choice<Kind> k_kinds[] = {
    {"mesh", Kind::mesh},     {"image", Kind::image},   {"material", Kind::material}, {"light", Kind::light},
    {"object", Kind::object}, {"camera", Kind::camera}, {"world", Kind::world},       {"settings", Kind::settings}};
inline constexpr Choice<Domain> k_domains[] = {
    {"vertex", Domain::vertex}, {"corner", Domain::corner}, {"face", Domain::face}};
inline constexpr Choice<Domain> k_normal_domains[] = {{"vertex", Domain::vertex}, {"corner", Domain::corner}};
inline constexpr Choice<DisplacementMethod> k_displacement_methods[] = {
    {"BUMP", DisplacementMethod::bump},
    {"DISPLACEMENT", DisplacementMethod::displacement},
    {"BOTH", DisplacementMethod::both}};
inline constexpr Choice<AttributeRole> k_roles[] = {
    {"generic", AttributeRole::generic}, {"uv", AttributeRole::uv}, {"color", AttributeRole::color}};
inline constexpr Choice<AlphaMode> k_alpha_modes[] = {{"straight", AlphaMode::straight},
                                                      {"premultiplied", AlphaMode::premultiplied},
                                                      {"channel_packed", AlphaMode::channel_packed},
                                                      {"none", AlphaMode::none}};
inline constexpr Choice<LightType> k_light_types[] = {
    {"point", LightType::point}, {"spot", LightType::spot}, {"sun", LightType::sun}, {"area", LightType::area}};
inline constexpr Choice<AreaShape> k_area_shapes[] = {{"square", AreaShape::square},
                                                      {"rectangle", AreaShape::rectangle},
                                                      {"disk", AreaShape::disk},
                                                      {"ellipse", AreaShape::ellipse}};
inline constexpr Choice<CameraType> k_camera_types[] = {{"perspective", CameraType::perspective},
                                                        {"orthographic", CameraType::orthographic}};
inline constexpr Choice<SensorFit> k_sensor_fits[] = {
    {"auto", SensorFit::automatic}, {"horizontal", SensorFit::horizontal}, {"vertical", SensorFit::vertical}};
inline constexpr Choice<MistFalloff> k_mist_falloffs[] = {{"LINEAR", MistFalloff::linear},
                                                          {"QUADRATIC", MistFalloff::quadratic},
                                                          {"INVERSE_QUADRATIC", MistFalloff::inverse_quadratic}};
inline constexpr Choice<PixelFilter> k_pixel_filters[] = {
    {"BOX", PixelFilter::box}, {"GAUSSIAN", PixelFilter::gaussian}, {"BLACKMAN_HARRIS", PixelFilter::blackman_harris}};

}  // namespace lambent::description
