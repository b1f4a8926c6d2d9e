// Which channels the passes of a render have, and what they are made of.
#include "engine/integrators/passes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <iterator>
#include <set>

namespace lambent {

namespace {

struct Kind {
  const char* name;
  PassKind kind;
  const char* letters;  ///< Channel::letters, as Blender has them
  bool light = false;   ///< sums what paths bring
};
constexpr bool k_light = true;

constexpr Kind k_kinds[] = {{"depth", PassKind::depth, "Z"},
                            {"mist", PassKind::mist, "Z"},
                            {"position", PassKind::position, "XYZ"},
                            {"normal", PassKind::normal, "XYZ"},
                            {"uv", PassKind::uv, "UVA"},
                            {"object_index", PassKind::object_index, "X"},
                            {"material_index", PassKind::material_index, "X"},
                            {"diffuse_direct", PassKind::diffuse_direct, "RGB", k_light},
                            {"diffuse_indirect", PassKind::diffuse_indirect, "RGB", k_light},
                            {"diffuse_color", PassKind::diffuse_color, "RGB"},
                            {"glossy_direct", PassKind::glossy_direct, "RGB", k_light},
                            {"glossy_indirect", PassKind::glossy_indirect, "RGB", k_light},
                            {"glossy_color", PassKind::glossy_color, "RGB"},
                            {"transmission_direct", PassKind::transmission_direct, "RGB", k_light},
                            {"transmission_indirect", PassKind::transmission_indirect, "RGB", k_light},
                            {"transmission_color", PassKind::transmission_color, "RGB"},
                            {"volume_direct", PassKind::volume_direct, "RGB"},
                            {"volume_indirect", PassKind::volume_indirect, "RGB"},
                            {"volume_scatter", PassKind::volume_scatter, "RGB"},
                            {"volume_transmit", PassKind::volume_transmit, "RGB"},
                            {"volume_majorant", PassKind::volume_majorant, "Z"},
                            {"emission", PassKind::emission, "RGB", k_light},
                            {"environment", PassKind::environment, "RGB", k_light},
                            {"ambient_occlusion", PassKind::ambient_occlusion, "RGB"},
                            {"shadow", PassKind::shadow, "RGB"},
                            {"sample_count", PassKind::sample_count, "X"},
                            {"noisy", PassKind::noisy, "RGBA", k_light},
                            {"noisy_shadow_catcher", PassKind::noisy_shadow_catcher, "RGB"},
                            {"denoising_albedo", PassKind::denoising_albedo, "RGB"},
                            {"denoising_normal", PassKind::denoising_normal, "XYZ"},
                            {"denoising_depth", PassKind::denoising_depth, "Z"},
                            {"denoising_specular_albedo", PassKind::denoising_specular_albedo, "RGB"},
                            {"denoising_roughness", PassKind::denoising_roughness, "X"},
                            {"aov_color", PassKind::aov_color, "RGBA"},
                            {"aov_value", PassKind::aov_value, "X"},
                            {"light_group", PassKind::light_group, "RGB", k_light},
                            {"cryptomatte_object", PassKind::cryptomatte_object, "rgba"},
                            {"cryptomatte_material", PassKind::cryptomatte_material, "rgba"},
                            {"cryptomatte_asset", PassKind::cryptomatte_asset, "rgba"},
                            {"caustics_direct", PassKind::caustics_direct, "RGB", k_light},
                            {"caustics_indirect", PassKind::caustics_indirect, "RGB", k_light},
                            {"technique_unidirectional", PassKind::technique_unidirectional, "RGB", k_light},
                            {"technique_connection", PassKind::technique_connection, "RGB", k_light},
                            {"technique_merging", PassKind::technique_merging, "RGB", k_light},
                            {"light_path", PassKind::light_path, "RGB", k_light},
                            {"without_shadow", PassKind::without_shadow, "RGB"},
                            {"shadow_difference", PassKind::shadow_difference, "RGB", k_light},
                            {"shadow_ratio", PassKind::shadow_ratio, "RGB", k_light},
                            {"shadow_catcher", PassKind::shadow_catcher, "RGB"},
                            {"error", PassKind::error, "RGB"},
                            {"time", PassKind::time, "X"},
                            {"render_time", PassKind::render_time, "X"},
                            {"vector", PassKind::vector, "XYZW"},
                            {"matte_light", PassKind::matte_light, "RGB"},
                            {"matte", PassKind::matte, "X"}};

/// Whether a path that light tracing found may count for it, of PassSettings::first_light_tracing vertices at least.
bool light_tracing_reaches(PassKind kind, int first_light_tracing) {
  switch (kind) {
    case PassKind::emission:  // what the camera sees by its own rays
    case PassKind::environment:
    case PassKind::technique_unidirectional:
    case PassKind::technique_merging:
      return false;
    case PassKind::diffuse_direct:
    case PassKind::glossy_direct:
    case PassKind::transmission_direct:
      return first_light_tracing <= 1;
    default:
      return true;
  }
}

constexpr int k_most_levels = 32;

bool is_of_light(PassKind kind) {
  return std::find_if(std::begin(k_kinds), std::end(k_kinds), [&](const Kind& k) { return k.kind == kind; })->light;
}

bool is_of_shadows(PassKind kind) {
  return kind == PassKind::without_shadow || kind == PassKind::shadow_difference || kind == PassKind::shadow_ratio;
}

/// A group without lights is black: a number that no light has.
constexpr uint16_t k_no_group = 0xffff;

uint16_t group_number(const Scene& scene, const std::string& name) {
  if (name.empty()) return 0;
  const std::vector<std::string>& groups = scene.light_groups();
  const auto found = std::find(groups.begin(), groups.end(), name);
  return static_cast<uint16_t>(found == groups.end() ? k_no_group : found - groups.begin() + 1);
}

bool is_cryptomatte(PassKind kind) {
  return kind >= PassKind::cryptomatte_object && kind <= PassKind::cryptomatte_asset;
}

LobeClass class_of_pass(PassKind kind) {
  switch (kind) {
    case PassKind::diffuse_direct:
    case PassKind::diffuse_indirect:
    case PassKind::diffuse_color:
      return LobeClass::diffuse;
    case PassKind::glossy_direct:
    case PassKind::glossy_indirect:
    case PassKind::glossy_color:
      return LobeClass::glossy;
    default:
      return LobeClass::transmission;
  }
}

/// The kind of what a pass is divided by: scattered light by the colour of what scatters it.
std::optional<PassKind> color_of(PassKind kind) {
  switch (kind) {
    case PassKind::diffuse_direct:
    case PassKind::diffuse_indirect:
      return PassKind::diffuse_color;
    case PassKind::glossy_direct:
    case PassKind::glossy_indirect:
      return PassKind::glossy_color;
    case PassKind::transmission_direct:
    case PassKind::transmission_indirect:
      return PassKind::transmission_color;
    case PassKind::shadow:
      return PassKind::unshadowed;
    case PassKind::vector:
      return PassKind::vector_weight;
    default:
      return std::nullopt;
  }
}

}  // namespace

std::vector<std::string> pass_kind_names() {
  std::vector<std::string> names;
  for (const Kind& kind : k_kinds) names.emplace_back(kind.name);
  return names;
}

// --- The plan --------------------------------------------------------------------------------------------------------

std::shared_ptr<const PassPlan> PassPlan::create(const std::vector<PassRequest>& requests, const Scene& scene,
                                                 const PassSettings& settings, Report& report) {
  const auto plan = std::make_shared<PassPlan>();
  plan->settings_ = settings;
  std::set<std::string> names{"combined"};
  size_t channels = 1;
  for (const PassRequest& request : requests) {
    const auto leave_out = [&](const std::string& why) {
      report.warning("pass", request.name, fmt::format("Pass '{}' is left out: {}", request.name, why));
    };
    const auto kind =
        std::find_if(std::begin(k_kinds), std::end(k_kinds), [&](const Kind& k) { return request.kind == k.name; });
    if (kind == std::end(k_kinds)) {
      leave_out(fmt::format("there is no kind '{}' of pass", request.kind));
    } else if (!names.insert(request.name).second) {
      leave_out("another one has its name");
    } else if (++channels > k_most_channels) {
      leave_out(fmt::format("there are more than {} passes", k_most_channels));
    } else {
      FilmChannel channel{.name = request.name,
                          .components = static_cast<int>(std::strlen(kind->letters)),
                          .letters = kind->letters,
                          .splats = kind->light && light_tracing_reaches(kind->kind, settings.first_light_tracing)};
      plan->add(request, kind->kind, std::move(channel), scene, report);
    }
  }
  if (plan->light_.empty() && plan->data_.empty() && !scene.has_shadow_catchers()) return nullptr;
  const std::vector<Pass> asked = plan->data_;  // what is divided by may join them
  for (const Pass& pass : plan->light_) plan->divide(pass);
  for (const Pass& pass : asked) plan->divide(pass);
  plan->compare_with_unshadowed();
  if (scene.has_shadow_catchers()) plan->catch_shadows(scene.has_mattes());
  plan->lay_out();
  for (const Pass& pass : plan->light_) {
    const bool direct_caustics = pass.kind == PassKind::caustics_direct;
    plan->expressions_ = plan->expressions_ || pass.expression;
    plan->events_ = plan->events_ || pass.expression || direct_caustics || pass.kind == PassKind::caustics_indirect;
    plan->classes_ = plan->classes_ || direct_caustics || color_of(pass.kind);
  }
  return plan;
}

/// Where everything lies, and what is left for the end of a sample.
void PassPlan::lay_out() {
  layout_ = FilmLayout(channels_);
  const auto place_all = [&](std::vector<Pass>& passes) {
    for (Pass& pass : passes) {
      pass.sample = place(pass).sample;
      const int divided_by = channels_[static_cast<size_t>(pass.channel)].divided_by;
      if (divided_by >= 0) pass.divisor = layout_.places[static_cast<size_t>(divided_by)].sample;
      pass.picture = pass.kind == PassKind::noisy ||
                     ((pass.kind == PassKind::shadow_difference || pass.kind == PassKind::shadow_ratio) && !pass.group);
    }
  };
  place_all(light_);
  place_all(data_);
  for (std::vector<Pass>& passes : other_light_) place_all(passes);
  std::copy_if(light_.begin(), light_.end(), std::back_inserter(pictures_),
               [](const Pass& pass) { return pass.picture; });
  const auto is_late = [](const Pass& pass) {
    return pass.kind == PassKind::catcher_lit || pass.kind == PassKind::catcher_bare ||
           pass.kind == PassKind::catcher_cover || pass.kind == PassKind::catcher_behind ||
           (pass.kind == PassKind::without_shadow && !pass.group);
  };
  std::copy_if(data_.begin(), data_.end(), std::back_inserter(late_), is_late);
  for (const Pass& pass : data_) {
    switch (pass.kind) {
      case PassKind::depth:
      case PassKind::position:
      case PassKind::object_index:
      case PassKind::material_index:
        looked_at_.push_back(pass);
        break;
      case PassKind::aov_color:
      case PassKind::aov_value:
        aovs_.push_back(pass);
        break;
      case PassKind::matte:
        mattes_.push_back(pass);
        break;
      case PassKind::cryptomatte_object:
      case PassKind::cryptomatte_material:
      case PassKind::cryptomatte_asset:
        ids_.push_back(pass.kind);
        break;
      default:
        take_data_slot(pass);
    }
  }
  slots_ = slots_of(light_);
  for (size_t i = 0; i < other_light_.size(); ++i) other_slots_[i] = slots_of(other_light_[i]);
}

void PassPlan::take_data_slot(const Pass& pass) {
  DataSlots& slots = data_slots_;
  const auto take = [&](int& slot) {
    if (slot < 0)
      slot = pass.sample;
    else
      copies_.push_back({slot, pass.sample, channels_[static_cast<size_t>(pass.channel)].components});
  };
  const auto take_first = [&](int& slot) {
    slots.first_surface = true;
    take(slot);
  };
  switch (pass.kind) {
    case PassKind::diffuse_color:
    case PassKind::glossy_color:
    case PassKind::transmission_color:
      slots.albedos = true;
      return take(slots.colors[static_cast<size_t>(class_of_pass(pass.kind))]);
    case PassKind::denoising_albedo:
      slots.features = true;
      return take(slots.denoising_albedo);
    case PassKind::mist:
      slots.mist_per_m = 1.0f / (settings_.mist_depth_m > 0.0f ? settings_.mist_depth_m : 1e-6f);
      return take(slots.mist);
    case PassKind::ambient_occlusion:
      return take(slots.ambient_occlusion);
    case PassKind::shadow:
      return take(slots.shadow);
    case PassKind::unshadowed:
      return take(slots.unshadowed);
    case PassKind::vector:
      return take_first(slots.vector);
    case PassKind::vector_weight:
      return take_first(slots.vector_weight);
    case PassKind::normal:
      return take_first(slots.normal);
    case PassKind::denoising_normal:
      slots.features = true;
      return take(slots.denoising_normal);
    case PassKind::uv:
      return take_first(slots.uv);
    case PassKind::denoising_depth:
      slots.features = true;
      return take(slots.denoising_depth);
    case PassKind::denoising_specular_albedo:
      slots.sharp = true;
      return take(slots.denoising_specular_albedo);
    case PassKind::denoising_roughness:
      slots.sharp = true;
      return take(slots.denoising_roughness);
    case PassKind::time:
      return take(slots.time);
    case PassKind::render_time:
      return take(slots.render_time);
    default:
      return;
  }
}

PassPlan::LightSlots PassPlan::slots_of(const std::vector<Pass>& passes) {
  LightSlots slots;
  slots.techniques.fill(-1);
  for (const Pass& pass : passes) {
    if (pass.picture) continue;  // whole: comes at the end of a sample
    // A kind that was asked for before has its slots taken.
    bool taken = false;
    const auto take = [&](int& slot) {
      if (slot < 0)
        slot = pass.sample;
      else
        taken = true;
    };
    const auto technique = [&](Technique t) { take(slots.techniques[static_cast<size_t>(t)]); };
    switch (pass.kind) {
      case PassKind::emission:
        take(slots.emission);
        break;
      case PassKind::environment:
        take(slots.environment);
        break;
      case PassKind::diffuse_direct:
      case PassKind::glossy_direct:
      case PassKind::transmission_direct:
        take(slots.direct[static_cast<size_t>(class_of_pass(pass.kind))]);
        break;
      case PassKind::diffuse_indirect:
      case PassKind::glossy_indirect:
      case PassKind::transmission_indirect:
        take(slots.indirect[static_cast<size_t>(class_of_pass(pass.kind))]);
        break;
      case PassKind::caustics_direct:
        take(slots.caustics_direct);
        break;
      case PassKind::caustics_indirect:
        take(slots.caustics_indirect);
        break;
      case PassKind::technique_unidirectional:
        technique(Technique::emission_hit);
        technique(Technique::next_event);
        break;
      case PassKind::technique_connection:
        technique(Technique::connection);
        technique(Technique::light_tracing);
        break;
      case PassKind::technique_merging:
        technique(Technique::merging);
        break;
      case PassKind::light_group:
        if (*pass.group == k_no_group) break;
        if (slots.groups.size() <= *pass.group) slots.groups.resize(*pass.group + 1u, -1);
        take(slots.groups[*pass.group]);
        break;
      default:
        taken = true;
    }
    if (taken) slots.by_rule.push_back(pass);
  }
  return slots;
}

void PassPlan::add(const PassRequest& request, PassKind kind, FilmChannel channel, const Scene& scene, Report& report) {
  Pass pass{.kind = kind};
  if (is_cryptomatte(kind)) {
    int levels = 6;
    std::from_chars(request.argument.data(), request.argument.data() + request.argument.size(), levels);
    channel.components = 4 * ((std::clamp(levels, 1, k_most_levels) + 1) / 2);
    channel.rule = ChannelRule::ids;
  } else if (kind == PassKind::depth || kind == PassKind::position || kind == PassKind::object_index ||
             kind == PassKind::material_index) {
    channel.rule = ChannelRule::first;
  } else if (kind == PassKind::ambient_occlusion) {
    channel.rule = ChannelRule::share;
  } else if (kind == PassKind::sample_count) {
    channel.rule = ChannelRule::sample_count;
  } else if (kind == PassKind::error) {
    channel.rule = ChannelRule::error;
  } else if (kind == PassKind::shadow_catcher || kind == PassKind::noisy_shadow_catcher) {
    channel.rule = ChannelRule::caught;
  } else if (kind == PassKind::vector) {
    data_slots_.world_moves = request.argument == "world";
  } else if (kind == PassKind::denoising_albedo || kind == PassKind::denoising_normal ||
             kind == PassKind::denoising_depth) {
    if (request.argument == "blended") data_slots_.sharp_rule = SharpRule::blended;
  } else if (kind == PassKind::render_time) {
    channel.total = true;
  } else if (kind == PassKind::aov_color || kind == PassKind::aov_value) {
    pass.aov = request.argument;
  } else if (kind == PassKind::light_group) {
    pass.group = group_number(scene, request.argument);
  } else if (is_of_shadows(kind)) {
    if (!request.argument.empty()) pass.group = group_number(scene, request.argument);
  } else if (kind == PassKind::matte) {
    const std::vector<std::string>& mattes = scene.mattes();
    const auto found = std::find(mattes.begin(), mattes.end(), request.argument);
    if (found == mattes.end()) {
      report.warning(
          "pass", request.name,
          fmt::format("Pass '{}' is left out: there are more than {} mattes", request.name, Scene::k_most_mattes));
      return;
    }
    pass.matte = static_cast<size_t>(found - mattes.begin());
  } else if (kind == PassKind::light_path) {
    Result<LightPathExpression> expression = LightPathExpression::parse(request.argument, scene.light_groups());
    if (!expression) {
      report.warning("pass", request.name,
                     fmt::format("Pass '{}' is left out: in its expression '{}', {}", request.name, request.argument,
                                 expression.error()));
      return;
    }
    pass.expression = std::move(*expression);
  }
  pass.channel = static_cast<int>(channels_.size());
  (is_of_light(kind) ? light_ : data_).push_back(std::move(pass));
  channels_.push_back(std::move(channel));
}

/// What a pass is divided by is a hidden channel where that is not asked for itself.
void PassPlan::divide(const Pass& pass) {
  const std::optional<PassKind> divisor = color_of(pass.kind);
  if (!divisor) return;
  auto found = std::find_if(data_.begin(), data_.end(), [&](const Pass& other) { return other.kind == *divisor; });
  if (found == data_.end()) {
    found = data_.insert(found, {.kind = *divisor, .channel = static_cast<int>(channels_.size())});
    channels_.push_back({.name = {}, .components = *divisor == PassKind::vector_weight ? 1 : 3, .hidden = true});
  }
  channels_[static_cast<size_t>(pass.channel)].divided_by = found->channel;
}

/// The picture without shadows, and what each light group is in it, are channels of their own, hidden where they are
/// not asked for themselves.
void PassPlan::compare_with_unshadowed() {
  std::set<std::optional<uint16_t>> groups;
  for (const std::vector<Pass>* passes : {&light_, &data_})
    for (const Pass& pass : *passes)
      if (is_of_shadows(pass.kind)) groups.insert(pass.group);
  if (groups.empty()) return;
  groups.insert(std::nullopt);  // that picture's own splats need a plane
  for (const std::optional<uint16_t> group : groups) {
    const auto asked = std::find_if(data_.begin(), data_.end(), [&](const Pass& pass) {
      return pass.kind == PassKind::without_shadow && pass.group == group;
    });
    const int without = asked != data_.end() ? asked->channel : static_cast<int>(channels_.size());
    if (asked == data_.end()) {
      data_.push_back({.kind = PassKind::without_shadow, .channel = without, .group = group});
      channels_.push_back({.name = {}, .components = 3, .hidden = true});
    }
    channels_[static_cast<size_t>(without)].splats = true;
    if (group)
      other_light(OtherPicture::without_shadows)
          .push_back({.kind = PassKind::light_group, .channel = without, .group = group});
    else
      other_channels_[static_cast<size_t>(OtherPicture::without_shadows)] = without;
    for (const Pass& pass : light_) {
      FilmChannel& channel = channels_[static_cast<size_t>(pass.channel)];
      if (pass.kind == PassKind::shadow_ratio && pass.group == group) channel.divided_by = without;
      if (pass.kind == PassKind::shadow_difference && pass.group == group) channel.minus = without;
    }
  }
}

/// The light of the catchers with and without what shades them, their cover and the world behind: hidden channels, of
/// which the picture and the pass are made when they are read.
void PassPlan::catch_shadows(bool mattes) {
  const auto add_part = [&](PassKind kind, int components, bool splats) {
    const int channel = static_cast<int>(channels_.size());
    data_.push_back({.kind = kind, .channel = channel});
    channels_.push_back({.name = {}, .components = components, .hidden = true, .splats = splats});
    return channel;
  };
  ShadowCatcher parts;
  parts.lit = add_part(PassKind::catcher_lit, 3, true);
  parts.bare = add_part(PassKind::catcher_bare, 3, true);
  parts.cover = add_part(PassKind::catcher_cover, 1, false);
  if (!settings_.film_transparent) parts.behind = add_part(PassKind::catcher_behind, 3, false);
  if (mattes) {
    const auto asked =
        std::find_if(data_.begin(), data_.end(), [](const Pass& pass) { return pass.kind == PassKind::matte_light; });
    parts.brought = asked != data_.end() ? asked->channel : add_part(PassKind::matte_light, 3, true);
    channels_[static_cast<size_t>(parts.brought)].splats = true;
    other_light(OtherPicture::catcher_lit).push_back({.kind = PassKind::matte_light, .channel = parts.brought});
  }
  other_channels_[static_cast<size_t>(OtherPicture::catcher_lit)] = parts.lit;
  other_channels_[static_cast<size_t>(OtherPicture::catcher_bare)] = parts.bare;
  for (FilmChannel& channel : channels_)
    if (channel.rule == ChannelRule::caught) {
      channel.catcher = parts;
      parts.in_picture = false;  // as in Cycles
    }
  channels_.front().catcher = parts;
}

}  // namespace lambent
