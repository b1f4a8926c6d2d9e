// Passes mean the same under every integrator: what must add up does, pixel by pixel, and each pass of each integrator
// has the path tracer's expectation (Welch's test over batches).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <span>

#include "engine/integrators/integrator.h"
#include "tests/agreement/integrator_scenes.h"
#include "tests/common/direct_render.h"
#include "tests/common/welch.h"

namespace lambent::test {
namespace {

constexpr int k_batches = 16;

const char* const k_scattered[3] = {"diffuse", "glossy", "transmission"};

const std::vector<IntegratorCase>& cases() {
  static const std::vector<IntegratorCase> chosen = [] {
    std::vector<IntegratorCase> result;
    for (const IntegratorCase& one : lobe_cases())
      for (const char* name : {"lobe_principled_1", "lobe_principled_1_transmission", "lobe_diffuse_and_mirror",
                               "lobe_half_transparent", "lobe_glass_05", "lobe_more_than_all"})
        if (one.name == name) result.push_back(one);
    for (const IntegratorCase& one : linking_cases())
      for (const char* name : {"linking_area_seen_in_mirrors", "linking_mesh_seen_in_gloss",
                               "linking_mesh_reaches_the_floor_through_the_screen"})
        if (one.name == name) result.push_back(one);
    return result;
  }();
  return chosen;
}

/// The scene with its emitters in two groups by turns, and all passes of light.
SceneMaker with_passes(SceneMaker maker, int64_t samples) {
  std::vector<std::string> ids;
  for (const auto& [id, object] : maker.description().objects) ids.push_back(id);
  for (size_t i = 0; i < ids.size(); ++i) maker.object(ids[i]).light_group = i % 2 ? "odd" : "even";
  std::vector<description::Pass>& passes = maker.settings.passes;
  for (const std::string scattered : k_scattered)
    for (const char* part : {"_direct", "_indirect", "_color"})
      passes.push_back({scattered + part, scattered + part, ""});
  for (const char* kind : {"emission", "environment", "ambient_occlusion", "caustics_direct", "caustics_indirect",
                           "technique_unidirectional", "technique_connection", "technique_merging"})
    passes.push_back({kind, kind, ""});
  for (const char* group : {"even", "odd", ""})
    passes.push_back({fmt::format("group {}", group), "light_group", group});
  for (const char* path : {"C.*L", "C<RD>L", "C<RD>[GS].*L", "C.D.*L", "CGL", "C<T.>.*L"})
    passes.push_back({path, "light_path", path});
  maker.settings.samples = samples;
  maker.settings.light_threshold = 0.0f;
  return maker;
}

/// The RGB of every pixel of each channel, light passes multiplied by the colour that they are divided by.
using Values = std::map<std::string, std::vector<double>>;

Values values_of(const Picture& picture) {
  Values result;
  size_t components = 0;
  for (const Channel& channel : picture.channels) components += static_cast<size_t>(channel.components);
  size_t first = 0;
  for (const Channel& channel : picture.channels) {
    std::vector<double>& values = result[channel.name];
    for (size_t at = first; at < picture.pixels.size(); at += components)
      for (size_t k = 0; k < 3; ++k) values.push_back(static_cast<double>(picture.pixels[at + k]));
    first += static_cast<size_t>(channel.components);
  }
  for (const std::string scattered : k_scattered)
    for (const char* part : {"_direct", "_indirect"})
      for (size_t i = 0; i < result[scattered + part].size(); ++i)
        result[scattered + part][i] *= result[scattered + "_color"][i];
  return result;
}

void expect_sum(const Values& values, const std::vector<std::string>& parts, const std::string& what) {
  const std::vector<double>& whole = values.at("combined");
  double worst = 0.0;
  for (size_t i = 0; i < whole.size(); ++i) {
    double sum = 0.0;
    for (const std::string& part : parts) sum += values.at(part)[i];
    worst = std::max(worst, std::fabs(sum - whole[i]) / (std::fabs(whole[i]) + 1e-6));
  }
  // A dozen floats, each rounded twice.
  EXPECT_LT(worst, 1e-5) << what;
}

class Passes : public testing::TestWithParam<size_t> {};

TEST_P(Passes, add_up_to_the_picture_in_every_integrator) {
  const IntegratorCase& one = cases()[GetParam()];
  SceneMaker maker = with_passes(one.maker, 2);
  std::vector<std::string> integrators = one.integrators;
  integrators.emplace_back("PT");
  for (const std::string& integrator : integrators) {
    maker.settings.integrator = integrator;
    const Values values = values_of(render(maker.transaction()));
    const std::string what = one.name + " " + integrator;
    std::vector<std::string> light{"emission", "environment"};
    for (const std::string scattered : k_scattered)
      for (const char* part : {"_direct", "_indirect"}) light.push_back(scattered + part);
    expect_sum(values, light, what + ", passes of light");
    expect_sum(values, {"group even", "group odd", "group "}, what + ", light groups");
    expect_sum(values, {"technique_unidirectional", "technique_connection", "technique_merging"},
               what + ", techniques");
    expect_sum(values, {"C.*L"}, what + ", all paths");
  }
}

TEST_P(Passes, have_the_path_tracers_expectation) {
  const IntegratorCase& one = cases()[GetParam()];
  // Batches of the mean over the picture, by channel.
  const auto batches = [&](const std::string& integrator, uint32_t first_seed) {
    std::map<std::string, std::vector<double>> means;
    SceneMaker maker = with_passes(one.maker, 4);
    maker.settings.integrator = integrator;
    for (uint32_t batch = 0; batch < k_batches; ++batch) {
      maker.settings.seed = first_seed + batch;
      for (const auto& [name, values] : values_of(render(maker.transaction()))) {
        if (name.starts_with("technique")) continue;
        double sum = 0.0;
        for (const double value : values) sum += value;
        means[name].push_back(sum / static_cast<double>(values.size()));
      }
    }
    return means;
  };
  const auto reference = batches("PT", 100);
  const size_t comparisons = reference.size() * one.integrators.size() * cases().size();
  for (size_t i = 0; i < one.integrators.size(); ++i)
    for (const auto& [name, found] : batches(one.integrators[i], 1000 + 100 * static_cast<uint32_t>(i))) {
      const std::vector<double>& expected = reference.at(name);
      const WelchResult test = welch_test(found, expected, 1e-6);
      double mean = 0.0;
      for (const double value : expected) mean += value / k_batches;
      EXPECT_GT(test.p_value, 0.01 / static_cast<double>(comparisons))
          << one.name << " " << one.integrators[i] << ", pass '" << name << "': differs by " << test.difference
          << " +- " << test.standard_error << " from " << mean;
    }
}

INSTANTIATE_TEST_SUITE_P(, Passes, testing::Range(size_t{0}, cases().size()),
                         [](const testing::TestParamInfo<size_t>& one) { return cases()[one.param].name; });

/// Every kind there is but for times, which no render repeats.
std::vector<description::Pass> everything() {
  std::vector<description::Pass> passes;
  for (const std::string& kind : available_passes())
    if (kind != "combined" && kind != "time" && kind != "render_time")
      passes.push_back({kind, kind, kind == "light_path" ? "C.*L" : "6"});
  return passes;
}

TEST(PassesOfARender, do_not_depend_on_threads_tiles_or_each_other) {
  for (const char* integrator : {"PT", "VCM"}) {
    SceneMaker maker = room(3);
    maker.settings.integrator = integrator;
    maker.settings.passes = everything();
    maker.settings.tile_size_px = 16;
    const Picture reference = render(maker.transaction(), 1);
    maker.settings.tile_size_px = 24;
    EXPECT_EQ(render(maker.transaction(), 5).pixels, reference.pixels) << integrator;

    // The picture is bit for bit that of a render without passes.
    maker.settings.passes.clear();
    const Picture plain = render(maker.transaction());
    const size_t components = reference.pixels.size() / (plain.pixels.size() / 4);
    for (size_t pixel = 0; pixel < plain.pixels.size() / 4; ++pixel)
      for (size_t k = 0; k < 4; ++k)
        ASSERT_EQ(plain.pixels[4 * pixel + k], reference.pixels[components * pixel + k]) << integrator << " " << pixel;
  }
}

TEST(PassesOfARender, continue_from_a_checkpoint_bit_for_bit) {
  SceneMaker maker = room(24);
  maker.settings.integrator = "VCM";
  maker.settings.passes = everything();
  EXPECT_EQ(render_interrupted(maker, 2).pixels, render(maker.transaction()).pixels);
}

TEST(PassesOfARender, that_are_not_finite_cost_the_picture_nothing) {
  SceneMaker maker = room(2);
  const Picture plain = render(maker.transaction());
  maker.settings.passes = {{"Mist", "mist", ""}};
  maker.settings.mist.start_m = std::numeric_limits<float>::quiet_NaN();
  const Picture picture = render(maker.transaction());
  for (size_t pixel = 0; pixel < plain.pixels.size() / 4; ++pixel) {
    for (size_t k = 0; k < 4; ++k) ASSERT_EQ(picture.pixels[5 * pixel + k], plain.pixels[4 * pixel + k]) << pixel;
    ASSERT_TRUE(std::isfinite(picture.pixels[5 * pixel + 4])) << pixel;
  }
}

TEST(PassesOfARender, of_another_kind_under_the_same_name_are_not_continued) {
  SceneMaker maker = room(4);
  const std::string path = testing::TempDir() + "lambent_other_passes.checkpoint";
  const auto engine = Engine::create({});
  const auto run = [&](const std::string& expression, const std::string& save, const std::string& load) {
    maker.settings.passes = {{"Light", "light_path", expression}};
    RenderOutcome outcome;
    SessionEvents events;
    events.done = [&](const RenderOutcome& done) { outcome = done; };
    Session session(engine, events);
    session.apply(maker.transaction());
    if (!load.empty()) {
      EXPECT_TRUE(static_cast<bool>(session.load_checkpoint(load)));
    }
    session.start(1);
    session.wait();
    if (!save.empty()) {
      EXPECT_TRUE(static_cast<bool>(session.save_checkpoint(save)));
    }
    return outcome.status;
  };
  EXPECT_EQ(run("CD.*L", path, ""), RenderStatus::finished);
  EXPECT_EQ(run("CD.*L", "", path), RenderStatus::finished);
  EXPECT_EQ(run("CG.*L", "", path), RenderStatus::failed);
  std::remove(path.c_str());
}

// That the others are never reached is CHECKed whenever something splats; that those that are have planes, that passes
// add up and have the path tracer's expectation (above).
TEST(PassesOfARender, have_memory_for_splats_only_where_light_tracing_may_reach_them) {
  const auto scene = build_scene(cases().front().maker);
  std::vector<PassRequest> requests;
  for (const description::Pass& pass : with_passes(cases().front().maker, 1).settings.passes)
    requests.push_back({pass.name, pass.kind, pass.argument});
  const std::set<std::string> never{"emission", "environment", "technique_unidirectional", "technique_merging"};
  for (const auto& [integrator, direct] : {std::pair{"LT", true}, {"BPT", false}, {"VCM", false}}) {
    PassSettings settings;
    settings.first_light_tracing = first_light_tracing(integrator);
    Report report;
    const auto plan = PassPlan::create(requests, *scene, settings, report);
    ASSERT_TRUE(plan);
    const FilmLayout layout(plan->channels());
    for (size_t c = 1; c <= requests.size(); ++c) {
      const std::string& name = plan->channels()[c].name;
      const bool data = name.ends_with("_color") || name == "ambient_occlusion";
      const bool reached =
          !data && !never.contains(name) && (direct || !name.ends_with("_direct") || name == "caustics_direct");
      EXPECT_EQ(layout.places[c].plane >= 0, reached) << integrator << " " << name;
    }
  }
}

// PT, BPT and VCM tell it by their own next event and next ray, PPM's recorder samples for itself.
TEST(PassesOfARender, shadow_and_occlusion_are_the_same_however_they_are_found) {
  std::vector<IntegratorCase> scenes = light_cases();
  for (const IntegratorCase& one : lobe_cases()) scenes.push_back(one);
  const std::set<std::string> chosen{"light_environment", "light_mixture", "lobe_principled_1",
                                     "lobe_half_transparent"};
  size_t tested = 0;
  for (const IntegratorCase& one : scenes) {
    if (!chosen.contains(one.name)) continue;
    ++tested;
    const auto batches = [&](const std::string& integrator, uint32_t first_seed) {
      std::map<std::string, std::vector<double>> means;
      SceneMaker maker = one.maker;
      maker.settings.integrator = integrator;
      // Many samples of few pixels: they are spread within pixels, so that means of as many vary less, and what is a
      // ratio of sums is less biased.
      maker.settings.width = maker.settings.height = 8;
      maker.settings.samples = 512;
      for (const char* kind : {"shadow", "ambient_occlusion"}) maker.settings.passes.push_back({kind, kind, ""});
      for (uint32_t batch = 0; batch < k_batches / 2; ++batch) {
        maker.settings.seed = first_seed + batch;
        const Picture picture = render(maker.transaction());
        const size_t components = 4 + 3 + 3, pixels = picture.pixels.size() / components;
        double shadow = 0.0, occlusion = 0.0;
        for (size_t i = 0; i < pixels; ++i)
          for (size_t k = 4; k < components; ++k)
            (k < 7 ? shadow : occlusion) += static_cast<double>(picture.pixels[i * components + k]);
        means["shadow"].push_back(shadow / static_cast<double>(3 * pixels));
        means["occlusion"].push_back(occlusion / static_cast<double>(3 * pixels));
      }
      return means;
    };
    const auto reference = batches("PT", 100);
    EXPECT_GT(reference.at("shadow").front(), 0.05) << one.name;
    for (const char* integrator : {"BPT", "VCM", "PPM"})
      for (const auto& [name, found] : batches(integrator, 1000)) {
        const WelchResult test = welch_test(found, reference.at(name), 1e-4);
        EXPECT_GT(test.p_value, 1e-4) << one.name << " " << integrator << " " << name << " differs by "
                                      << test.difference << " +- " << test.standard_error << " from "
                                      << reference.at(name).front();
      }
  }
  EXPECT_EQ(tested, chosen.size());
}

// Where little light is at stake the path tracer asks by roulette what stands before it, for the pass too.
TEST(PassesOfARender, shadow_is_the_same_where_small_shadow_rays_play_roulette) {
  for (const IntegratorCase& one : light_cases()) {
    if (one.name != "light_mixture") continue;
    const auto batches = [&](float threshold, uint32_t first_seed) {
      std::vector<double> means;
      SceneMaker maker = one.maker;
      maker.settings.integrator = "PT";
      maker.settings.width = maker.settings.height = 8;
      maker.settings.samples = 1024;
      maker.settings.light_threshold = threshold;
      maker.settings.passes.push_back({"shadow", "shadow", ""});
      for (uint32_t batch = 0; batch < k_batches / 2; ++batch) {
        maker.settings.seed = first_seed + batch;
        const Picture picture = render(maker.transaction());
        double sum = 0.0;
        for (size_t i = 0; i < picture.pixels.size(); i += 7) sum += static_cast<double>(picture.pixels[i + 4]);
        means.push_back(sum / 64.0);
      }
      return means;
    };
    const std::vector<double> all = batches(0.0f, 100), some = batches(3.0f, 1000);
    const WelchResult test = welch_test(some, all, 1e-4);
    EXPECT_GT(test.p_value, 1e-4) << test.difference << " +- " << test.standard_error << " from " << all.front();
    return;
  }
  FAIL() << "no such scene";
}

/// The scene, its ball chosen for passes of shadows, with these passes.
SceneMaker with_shadow_passes(const std::string& integrator, const std::string& name) {
  for (const IntegratorCase& one : lobe_cases())
    if (one.name == name) {
      SceneMaker maker = one.maker;
      maker.settings.integrator = integrator;
      maker.settings.light_threshold = 0.0f;
      maker.settings.samples = 4;
      maker.object("ball").shadow_pass = true;
      for (const char* kind : {"without_shadow", "shadow_difference", "shadow_ratio"})
        maker.settings.passes.push_back({kind, kind, ""});
      return maker;
    }
  ADD_FAILURE() << "no case " << name;
  return SceneMaker(1, 1, 1);
}

TEST(ShadowPasses, give_back_the_picture) {
  for (const char* integrator : {"PT", "LT", "VPL", "BPT", "PPM", "VCM"}) {
    const Values values = values_of(render(with_shadow_passes(integrator, "lobe_glass_05").transaction()));
    const std::vector<double>& whole = values.at("combined");
    const std::vector<double>& without = values.at("without_shadow");
    double shadow = 0.0, caustic = 0.0;
    for (size_t i = 0; i < whole.size(); ++i) {
      const double difference = values.at("shadow_difference")[i], ratio = values.at("shadow_ratio")[i];
      ASSERT_NEAR(without[i] + difference, whole[i], 1e-6 * (without[i] + whole[i])) << integrator << " " << i;
      if (without[i] > 1e-3) {
        ASSERT_NEAR(without[i] * ratio, whole[i], 1e-5 * whole[i]) << integrator << " " << i;
      }
      shadow = std::max(shadow, -difference);
      caustic = std::max(caustic, difference);
    }
    EXPECT_GT(shadow, 0.05) << integrator << ": glass casts a shadow";
    EXPECT_GT(caustic, 0.05) << integrator << ": and light";
  }
}

TEST(ShadowPasses, are_the_picture_of_the_scene_whose_chosen_objects_only_the_camera_sees) {
  for (const char* name : {"lobe_rough_diffuse", "lobe_half_transparent", "lobe_glass_05"}) {
    SceneMaker direct = with_shadow_passes("PT", name);
    direct.settings.passes.clear();
    description::Visibility& visibility = direct.object("ball").visibility;
    visibility.diffuse = visibility.glossy = visibility.transmission = visibility.shadow = false;
    const auto batches = [](SceneMaker maker, const std::string& channel, uint32_t first_seed) {
      std::vector<std::vector<double>> rows;  // by row of pixels and batch
      for (uint32_t batch = 0; batch < k_batches; ++batch) {
        maker.settings.seed = first_seed + batch;
        const std::vector<double> values = values_of(render(maker.transaction())).at(channel);
        const size_t rows_of = static_cast<size_t>(maker.settings.height), length = values.size() / rows_of;
        rows.resize(rows_of);
        for (size_t row = 0; row < rows_of; ++row) {
          double sum = 0.0;
          for (size_t i = 0; i < length; ++i) sum += values[row * length + i];
          rows[row].push_back(sum / static_cast<double>(length));
        }
      }
      return rows;
    };
    const auto expected = batches(direct, "combined", 100);
    for (const char* integrator : {"PT", "BPT", "VCM"}) {
      const auto found = batches(with_shadow_passes(integrator, name), "without_shadow", 1000);
      for (size_t row = 0; row < expected.size(); ++row)
        EXPECT_GT(welch_test(found[row], expected[row], 1e-6).p_value, 1e-5 / static_cast<double>(expected.size()))
            << name << " " << integrator << ", row " << row;
    }
  }
}

TEST(ShadowPasses, say_so_where_no_object_is_chosen) {
  SceneMaker maker = with_shadow_passes("PT", "lobe_glass_05");
  maker.object("ball").shadow_pass = false;
  Report report;
  const Values values = values_of(render(maker.transaction(), 0, nullptr, &report));
  const std::vector<double>&without = values.at("without_shadow"), &whole = values.at("combined");
  ASSERT_EQ(without.size(), whole.size());
  for (size_t i = 0; i < whole.size(); ++i)
    ASSERT_FLOAT_EQ(static_cast<float>(without[i]), static_cast<float>(whole[i]));
  ASSERT_EQ(report.messages().size(), 1u);
  EXPECT_NE(report.messages()[0].text.find("no object"), std::string::npos);
}

/// A wide floor that catches shadows, seen from above; a sun shines straight down, and a black card above the camera
/// takes half of its light.
SceneMaker caught(const std::string& integrator, bool film_transparent, bool sun_and_card = true) {
  SceneMaker maker(16, 16, 16);
  maker.settings.integrator = integrator;
  maker.settings.film_transparent = film_transparent;
  maker.material("gray", diffuse(Color(0.5f))).material("black", diffuse(Color(0.0f)));
  maker.mesh("floor", {{-99, -99, -2}, {99, -99, -2}, {99, 99, -2}, {-99, 99, -2}}, {{0, 1, 2}, {0, 2, 3}}, "gray");
  maker.object("floor").shadow_catcher = true;
  if (!sun_and_card) return maker;
  maker.mesh("card", {{-99, -99, 1}, {0, -99, 1}, {0, 99, 1}, {-99, 99, 1}}, {{0, 1, 2}, {0, 2, 3}}, "black");
  description::Light sun;
  sun.type = description::LightType::sun;
  sun.energy = 2.0f;
  maker.light("sun", sun, Transform());
  return maker;
}

/// The floats of a pixel: the picture's four first.
std::span<const float> pixel_of(const Picture& picture, int x, int y) {
  const size_t floats = picture.pixels.size() / static_cast<size_t>(picture.width * picture.height);
  return std::span(picture.pixels).subspan(static_cast<size_t>(picture.width * y + x) * floats, floats);
}

TEST(ShadowCatcher, is_alpha_where_the_light_does_not_come_and_a_factor_for_a_backdrop) {
  for (const char* integrator : {"PT", "BPT", "VCM"})
    for (const auto& [pass, holdout] : {std::pair{false, false}, {true, false}, {false, true}}) {
      SceneMaker maker = caught(integrator, true);
      maker.object("card").holdout = holdout;  // what cuts holes itself throws its shadow all the same
      if (pass) maker.settings.passes = {{"catcher", "shadow_catcher", ""}};
      const Picture picture = render(maker.transaction());
      for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) {
          if (x == 7 || x == 8) continue;  // the edge of the shadow
          const double shadow = x < 8 ? 0.0 : 1.0;
          SCOPED_TRACE(fmt::format("{} {}, {}", integrator, x, y));
          const std::span<const float> pixel = pixel_of(picture, x, y);
          ASSERT_EQ(Vec3(pixel[0], pixel[1], pixel[2]), Vec3(0.0f));
          ASSERT_NEAR(pixel[3], pass ? 0.0 : 1.0 - shadow, 1e-6);
          ASSERT_EQ(pixel.size(), pass ? 7u : 4u);
          for (const float value : pixel.subspan(4)) ASSERT_NEAR(value, shadow, 1e-6);
        }
    }
}

TEST(ShadowCatcher, darkens_the_world_behind_it_on_an_opaque_film) {
  for (const char* integrator : {"PT", "BPT"}) {
    SceneMaker maker = caught(integrator, false);
    const Color radiance(0.4f, 0.2f, 0.1f);
    maker.world(background(radiance));
    maker.settings.samples = 1024;
    const Picture picture = render(maker.transaction());
    // The default lens sees 0.72 of the floor on either side.
    for (const int x : {1, 14}) {
      const double from_edge = 0.72 * ((x + 0.5) / 8.0 - 1.0);
      const double seen = 0.5 * (1.0 + from_edge / std::hypot(from_edge, 3.0));  // of the sky, past a half plane
      const double sun = x < 8 ? 0.0 : 2.0;
      double sum[3] = {0, 0, 0};
      for (int y = 4; y < 12; ++y)
        for (int k = 0; k < 3; ++k) sum[k] += static_cast<double>(pixel_of(picture, x, y)[static_cast<size_t>(k)]) / 8;
      for (int k = 0; k < 3; ++k) {
        const double sky = std::numbers::pi * static_cast<double>(radiance[k]);
        const double expected = static_cast<double>(radiance[k]) * (sky * seen + sun) / (sky + 2.0);
        EXPECT_NEAR(sum[k], expected, 0.02 * expected) << integrator << " " << x;
      }
    }
  }
}

TEST(ShadowCatcher, lights_that_are_meshes_still_light_it) {
  SceneMaker maker = caught("PT", true, false);
  maker.material("light", emission(Color(1.0f), 20.0f));
  maker.mesh("panel", {{2, -1, 0.5f}, {2, 1, 0.5f}, {4, 1, 0.5f}, {4, -1, 0.5f}}, {{0, 1, 2}, {0, 2, 3}}, "light");
  const Picture picture = render(maker.transaction());
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) ASSERT_NEAR(pixel_of(picture, x, y)[3], 0.0, 1e-6);
}

TEST(ShadowCatcher, pass_is_white_and_free_where_there_is_none) {
  SceneMaker maker = caught("PT", true);
  maker.object("floor").shadow_catcher = false;
  maker.settings.passes = {{"catcher", "shadow_catcher", ""}};
  const Values values = values_of(render(maker.transaction()));
  for (const double value : values.at("catcher")) ASSERT_EQ(value, 1.0);
}

TEST(PassesOfARender, that_cannot_be_made_are_named_and_left_out) {
  SceneMaker maker = room(1);
  maker.settings.passes = {{"Depth", "depth", ""},
                           {"Depth", "mist", ""},
                           {"combined", "normal", ""},
                           {"What", "no such kind", ""},
                           {"Bad", "light_path", "C(DL"},
                           {"Dark", "light_group", "no such group"},
                           {"Nothing", "aov_color", "no such AOV"}};
  Report report;
  const Picture picture = render(maker.transaction(), 0, nullptr, &report);
  std::vector<std::string> names;
  for (const Channel& channel : picture.channels) names.push_back(channel.name);
  EXPECT_EQ(names, (std::vector<std::string>{"combined", "Depth", "Dark", "Nothing"}));
  std::vector<std::string> texts;
  for (const Message& message : report.messages())
    if (message.code == "pass") texts.push_back(message.text);
  EXPECT_EQ(texts, (std::vector<std::string>{
                       "Pass 'Depth' is left out: another one has its name",
                       "Pass 'combined' is left out: another one has its name",
                       "Pass 'What' is left out: there is no kind 'no such kind' of pass",
                       "Pass 'Bad' is left out: in its expression 'C(DL', at its end: a ')' is expected"}));
}

TEST(PassesOfARender, as_many_as_one_likes_up_to_a_limit) {
  SceneMaker maker = room(1);
  for (int i = 0; i < 300; ++i) maker.settings.passes.push_back({fmt::format("normal {}", i), "normal", ""});
  Report report;
  const Picture picture = render(maker.transaction(), 0, nullptr, &report);
  EXPECT_EQ(picture.channels.size(), 256u);
  EXPECT_EQ(report.messages().size(), 45u);
}

}  // namespace
}  // namespace lambent::test
