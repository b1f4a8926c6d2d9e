#include "tests/agreement/integrator_scene_parts.h"

namespace lambent::test {

Graph uneven_world() {
  GraphMaker graph;
  const int coordinates = graph.add("TexCoord", {});
  const int gradient = graph.add("TexGradient", {{"Vector", Link{coordinates, "Generated"}}},
                                 {{"gradient_type", std::string("SPHERICAL")}});
  const int parts = graph.add("SeparateXYZ", {{"Vector", Link{coordinates, "Generated"}}});
  const int edge = graph.add("Math", {{"Value", Link{parts, "Y"}}, {"Value_001", 0.3f}},
                             {{"operation", std::string("GREATER_THAN")}});
  const int scaled = graph.add("Math", {{"Value", Link{edge, "Value"}}, {"Value_001", 4.0f}, {"Value_002", 0.3f}},
                               {{"operation", std::string("MULTIPLY_ADD")}});
  const int colour = graph.add("CombineXYZ", {{"X", Link{scaled, "Value"}}, {"Y", 0.5f}, {"Z", Link{gradient, "Fac"}}});
  graph.add("Background", {{"Color", Link{colour, "Vector"}}, {"Strength", 1.0f}});
  return graph.surface("Background");
}

std::vector<IntegratorCase> light_cases() {
  std::vector<IntegratorCase> cases;
  const auto add = [&](const std::string& name, const Light& light, const Transform& transform = k_above,
                       const std::vector<std::string>& integrators = k_all) {
    SceneMaker maker = corridor();
    maker.light("l", light, transform);
    cases.push_back({"light_" + name, maker, integrators});
  };
  Light point = lamp(LightType::point, 60.0f);
  add("point", point, k_above, k_all_and_vpl);
  point.radius_m = 0.4f;
  add("point_with_radius", point);
  {
    SceneMaker among = corridor();
    among.light("l", point, k_above);
    const Vec3 middle(-0.5f, 2.0f, -1.5f);
    quad(among, "shade", middle + Vec3(-0.35f, -0.35f, -0.12f), middle + Vec3(0.35f, -0.35f, -0.12f),
         middle + Vec3(0.35f, 0.35f, -0.12f), "floor");
    cases.push_back({"light_point_with_radius_around_a_surface", among, k_all});
  }
  Light spot = lamp(LightType::spot, 200.0f);
  spot.spot_size_rad = 1.2f;
  spot.spot_blend = 0.5f;
  add("spot_with_blend", spot);
  spot.radius_m = 0.3f;
  add("spot_with_radius", spot);
  Light sun = lamp(LightType::sun, 2.0f);
  add("sun", sun);
  sun.angle_rad = 0.5f;
  add("sun_with_angle", sun);
  add("area_square", area(AreaShape::square, 1.0f, 1.0f, 60.0f), k_above, k_all_and_vpl);
  add("area_disk", area(AreaShape::disk, 1.2f, 1.2f, 60.0f));
  add("area_ellipse", area(AreaShape::ellipse, 1.5f, 0.6f, 60.0f));
  add("area_rectangle_with_spread", area(AreaShape::rectangle, 1.4f, 0.7f, 60.0f, 1.5f));
  add("area_ellipse_with_spread", area(AreaShape::ellipse, 1.4f, 0.7f, 60.0f, 1.0f));
  Light without_mis = area(AreaShape::square, 1.0f, 1.0f, 60.0f);
  without_mis.multiple_importance = false;
  add("area_without_multiple_importance", without_mis);
  Light textured = area(AreaShape::square, 1.0f, 1.0f, 60.0f);
  GraphMaker emits;
  const int geometry = emits.add("NewGeometry", {});
  const int parts = emits.add("SeparateXYZ", {{"Vector", Link{geometry, "Parametric"}}});
  emits.add("Emission", {{"Color", rgb(1, 1, 1)}, {"Strength", Link{parts, "X"}}});
  textured.graph = emits.surface("Emission");
  add("area_with_program", textured);
  Light shadowless = area(AreaShape::square, 1.0f, 1.0f, 60.0f);
  shadowless.shadows = false;
  add("area_without_shadows", shadowless, k_above, {"BPT", "VCM"});

  SceneMaker mesh = corridor();
  mesh.material("e", emission(Color(1.0f, 0.8f, 0.6f), 6.0f));
  quad(mesh, "e", {-0.8f, 1.6f, -1.5f}, {0.2f, 1.6f, -1.5f}, {0.2f, 2.6f, -1.2f}, "e");
  cases.push_back({"light_mesh", mesh, k_all});
  SceneMaker glowing =
      corridor(diffuse(Color(0.7f, 0.6f, 0.5f)), diffuse_emitter(Color(0.6f), Color(0.5f, 0.4f, 0.3f)));
  cases.push_back({"light_walls_that_emit_and_reflect", glowing, k_all});
  SceneMaker tetrahedron = corridor();
  tetrahedron.material("e", emission(Color(1.0f, 0.8f, 0.6f), 8.0f));
  tetrahedron.mesh("e", {{-0.5f, 1.8f, -1.5f}, {0.4f, 1.9f, -1.6f}, {0, 2.6f, -1.4f}, {0, 2, -1}},
                   {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}, "e");
  cases.push_back({"light_closed_mesh", tetrahedron, k_all});
  SceneMaker sky = corridor();
  sky.world(background(Color(0.6f, 0.8f, 1.0f)));
  cases.push_back({"light_environment", sky, k_all_and_vpl});
  SceneMaker uneven = corridor();
  uneven.world(uneven_world());
  cases.push_back({"light_environment_uneven", uneven, k_all});

  // What the camera sees is little of what light reaches: walks are aimed (pilot.h), by every light.
  const auto add_plain = [](SceneMaker& maker) {
    quad(maker, "plain", {-15, -15, -4.01f}, {15, -15, -4.01f}, {15, 15, -4.01f}, "floor");
  };
  SceneMaker wide = corridor();
  add_plain(wide);
  wide.world(uneven_world());
  wide.light("sun", lamp(LightType::sun, 0.7f), aimed({1, -1, 3}, {0, 0, 0}));
  wide.light("far", lamp(LightType::point, 4e3f), aimed({6, -9, 9}, {0, 0, -4}));
  wide.light("sheet", area(AreaShape::rectangle, 6, 6, 2e3f), aimed({-10, 0, 7}, {0, 0, -4}));
  wide.material("e", emission(Color(1.0f, 0.2f, 0.2f), 100.0f));
  quad(wide, "e", {10, -1, 6}, {10, 3, 6}, {10, 3, 9}, "e");
  cases.push_back({"light_far_and_wide", wide, k_round});
  SceneMaker city = corridor();
  add_plain(city);
  for (int i = 0; i < 80; ++i) {
    const float x = -12.0f + 24.0f * static_cast<float>((i * 7) % 40) / 39.0f,
                y = -12.0f + 24.0f * static_cast<float>((i * 13) % 80) / 79.0f;
    const bool round = i % 3 == 0;
    city.light("l" + std::to_string(i),
               round ? lamp(LightType::point, 200.0f) : area(AreaShape::square, 0.5f, 0.5f, 200.0f),
               aimed({x, y, 1.0f + static_cast<float>(i % 5)}, {0.3f * x, 0.3f * y, -4}));
  }
  cases.push_back({"light_many_far_and_wide", city, k_all});

  SceneMaker vast = corridor();
  quad(vast, "ground", {-2000, -2000, -9}, {2000, -2000, -9}, {2000, 2000, -9}, "floor");
  vast.light("sun", lamp(LightType::sun, 2.0f), k_above);
  cases.push_back({"light_sun_over_vast_ground", vast, k_all});

  SceneMaker mixture = corridor();
  mixture.world(uneven_world());
  mixture.light("point", lamp(LightType::point, 40.0f), k_above);
  mixture.light("sun", lamp(LightType::sun, 0.7f), aimed({1, -1, 3}, {0, 0, 0}));
  mixture.light("area", area(AreaShape::disk, 0.8f, 0.8f, 30.0f), aimed({0.5f, -2, -1}, {0, 0, -4}));
  mixture.material("e", emission(Color(1.0f, 0.2f, 0.2f), 3.0f));
  quad(mixture, "e", {2.4f, -1, -3}, {2.4f, 0, -3}, {2.4f, 0, -2}, "e");
  cases.push_back({"light_mixture", mixture, k_all});

  SceneMaker many = corridor();
  for (int i = 0; i < 60; ++i) {
    const float x = -2.2f + 4.4f * static_cast<float>((i * 7) % 20) / 19.0f,
                y = -2.6f + 5.2f * static_cast<float>((i * 13) % 60) / 59.0f;
    Light light = i % 3 == 0 ? lamp(LightType::point, 3.0f) : area(AreaShape::square, 0.2f, 0.2f, 3.0f);
    light.color = Color(1.0f, 0.3f + 0.01f * static_cast<float>(i), 0.9f - 0.01f * static_cast<float>(i));
    const float z = std::fabs(y) < 1.5f && std::fabs(x) < 1.5f ? 0.5f : -1.2f;  // behind the camera or beside its view
    many.light("l" + std::to_string(i), light, aimed({x, y, z}, {x * 0.3f, y * 0.3f, -4}));
  }
  cases.push_back({"light_many", many, k_all});
  return cases;
}

std::vector<IntegratorCase> camera_cases() {
  std::vector<IntegratorCase> cases;
  const auto add = [&](const std::string& name, auto&& change, SceneMaker maker,
                       const std::vector<std::string>& integrators = k_round) {
    change(maker);
    cases.push_back({"camera_" + name, maker, integrators});
  };
  const SceneMaker ball = lit_corner(diffuse(Color(0.3f, 0.5f, 0.7f)));
  const auto orthographic = [](SceneMaker& maker) {
    maker.camera.type = CameraType::orthographic;
    maker.camera.ortho_scale = 2.5f;
  };
  const auto lens = [](SceneMaker& maker) { maker.camera.depth_of_field = DepthOfField{2.5f, 0.15f, 0, 0.0f, 1.0f}; };
  add(
      "perspective", [](SceneMaker&) {}, ball);
  add("orthographic", orthographic, ball);
  add("depth_of_field", lens, ball);
  add(
      "depth_of_field_with_blades",
      [](SceneMaker& maker) {
        maker.camera.depth_of_field = DepthOfField{4.5f, 0.15f, 5, 0.3f, 1.6f};
      },
      ball);
  add(
      "orthographic_depth_of_field",
      [&](SceneMaker& maker) {
        orthographic(maker);
        lens(maker);
      },
      ball);
  add(
      "shift_and_pixel_aspect",
      [](SceneMaker& maker) {
        maker.camera.shift = {0.15f, -0.1f};
        maker.settings.pixel_aspect = {1.0f, 1.4f};
      },
      ball);
  add(
      "wide_angle", [](SceneMaker& maker) { maker.camera.focal_length_mm = 14.0f; }, ball);
  add(
      "turned",
      [](SceneMaker& maker) {
        maker.camera.transform = aimed({1.2f, 1.5f, -0.5f}, {0, -0.6f, -4});
      },
      ball);
  add(
      "clipped", [](SceneMaker& maker) { maker.camera.clip_near_m = 3.0f, maker.camera.clip_far_m = 4.6f; }, ball);
  add(
      "region",
      [](SceneMaker& maker) {
        maker.settings.region = {{5, 3, 21, 27}};
      },
      ball);
  add(
      "orthographic_flat",
      [](SceneMaker& maker) {
        maker.camera.type = CameraType::orthographic;
        maker.camera.ortho_scale = 2.5f;
      },
      lit_corridor(), k_all);
  add("depth_of_field_flat", lens, lit_corridor(), k_all);
  for (const auto& [name, filter, width] :
       {std::tuple{"gaussian", PixelFilter::gaussian, 3.0f}, {"blackman_harris", PixelFilter::blackman_harris, 4.0f}})
    add(
        std::string("filter_") + name,
        [&](SceneMaker& maker) {
          maker.settings.pixel_filter = filter;
          maker.settings.filter_width_px = width;
        },
        ball);
  add(
      "filter_and_region",
      [](SceneMaker& maker) {
        maker.settings.pixel_filter = PixelFilter::blackman_harris;
        maker.settings.filter_width_px = 3.0f;
        maker.settings.region = {{7, 2, 30, 18}};
      },
      ball);
  add(
      "transparent_film",
      [](SceneMaker& maker) {
        maker.settings.film_transparent = true;
        maker.camera.transform = aimed({2.5f, 2.5f, 2}, {0, -0.3f, -3.4f});
      },
      lit_corner(combined("MixShader", transparent(Color(1.0f)), diffuse(Color(0.7f)))));
  add(
      "exposure_and_threshold",
      [](SceneMaker& maker) {
        maker.settings.exposure = 3.0f;
        maker.settings.light_threshold = 0.3f;
      },
      ball);
  return cases;
}

std::vector<IntegratorCase> lobe_cases() {
  std::vector<IntegratorCase> cases;
  const auto ball = [&](const std::string& name, Graph graph, const std::vector<std::string>& integrators) {
    cases.push_back({"lobe_" + name, lit_corner(std::move(graph)), integrators});
  };
  ball("rough_diffuse", diffuse(Color(0.8f), 0.9f), k_round);
  ball("glossy_0", glossy(0.0f), k_round_delta);
  ball("glossy_005", glossy(0.005f), k_round_delta);
  ball("glossy_02", glossy(0.02f), k_round_delta);
  ball("glossy_05", glossy(0.05f), k_round_delta);
  ball("glossy_3", glossy(0.3f), k_round);
  ball("glossy_anisotropic", glossy(0.35f, 0.8f), k_round_delta);
  ball("beckmann",
       single("BsdfGlossy", {{"Color", rgb(0.8f, 0.7f, 0.6f)}, {"Roughness", 0.4f}},
              {{"distribution", std::string("BECKMANN")}}),
       k_round);
  ball("multiscatter",
       single("BsdfGlossy", {{"Color", rgb(0.8f, 0.7f, 0.6f)}, {"Roughness", 0.8f}},
              {{"distribution", std::string("MULTI_GGX")}}),
       k_round);
  ball("glass_0", glass(0.0f), k_round_delta);
  ball("glass_05", glass(0.05f), k_round_delta);
  ball("glass_3", glass(0.3f), k_round_delta);
  ball("refraction_0", single("BsdfRefraction", {{"Color", rgb(0.9f, 0.9f, 0.9f)}, {"Roughness", 0.0f}, {"IOR", 1.3f}}),
       k_round_delta);
  ball("refraction_3", single("BsdfRefraction", {{"Color", rgb(0.9f, 0.9f, 0.9f)}, {"Roughness", 0.3f}, {"IOR", 1.3f}}),
       k_round_delta);
  ball("translucent", single("BsdfTranslucent", {{"Color", rgb(0.8f, 0.5f, 0.4f)}}), k_round);
  ball("velvet", single("BsdfVelvet", {{"Color", rgb(0.8f, 0.5f, 0.4f)}, {"Sigma", 0.6f}}), k_round);
  ball("sheen", single("BsdfSheen", {{"Color", rgb(0.8f, 0.5f, 0.4f)}, {"Roughness", 0.5f}}), k_round);
  ball(
      "principled_hair",
      single("BsdfHairPrincipled", {{"Color", rgb(0.6f, 0.4f, 0.3f)}, {"Roughness", 0.4f}, {"Radial Roughness", 0.6f}}),
      k_round);
  ball("principled_hair_of_huang",
       single("BsdfHairPrincipled", {{"Color", rgb(0.6f, 0.4f, 0.3f)}, {"Roughness", 0.4f}, {"Aspect Ratio", 0.8f}},
              {{"model", std::string("HUANG")}}),
       k_round);
  ball("diffuse_and_translucent",
       combined("MixShader", diffuse(Color(0.8f)), single("BsdfTranslucent", {{"Color", rgb(0.8f, 0.5f, 0.4f)}})),
       k_round);
  ball("half_transparent", combined("MixShader", diffuse(Color(0.8f)), transparent(Color(0.9f, 0.8f, 0.7f))), k_round);
  ball("diffuse_and_mirror", combined("MixShader", diffuse(Color(0.8f)), glossy(0.0f)), k_round_delta);
  ball("more_than_all", combined("AddShader", diffuse(Color(0.9f)), glossy(0.3f, 0.0f, Color(0.6f))), k_round);
  ball("principled_1",
       single("BsdfPrincipled",
              {{"Base Color", rgb(0.7f, 0.4f, 0.3f)},
               {"Metallic", 0.3f},
               {"Specular", 0.5f},
               {"Roughness", 0.35f},
               {"Sheen", 0.5f},
               {"Clearcoat", 0.8f},
               {"Clearcoat Roughness", 0.1f},
               {"Anisotropic", 0.5f}},
              {{"generation", 1.0f}, {"distribution", std::string("GGX")}}),
       k_round);
  ball("principled_1_transmission",
       single("BsdfPrincipled",
              {{"Base Color", rgb(0.7f, 0.8f, 0.9f)},
               {"Transmission", 0.8f},
               {"Roughness", 0.3f},
               {"IOR", 1.4f},
               {"Alpha", 0.8f}},
              {{"generation", 1.0f}, {"distribution", std::string("MULTI_GGX")}}),
       k_round_delta);
  ball("principled_2",
       single("BsdfPrincipled",
              {{"Base Color", rgb(0.7f, 0.4f, 0.3f)},
               {"Metallic", 0.3f},
               {"Specular IOR Level", 0.5f},
               {"Roughness", 0.35f},
               {"Sheen Weight", 0.5f},
               {"Coat Weight", 0.7f},
               {"Coat Roughness", 0.2f},
               {"Coat Tint", rgb(1.0f, 0.8f, 0.7f)}},
              {{"generation", 2.0f}, {"distribution", std::string("MULTI_GGX")}}),
       k_round);
  ball("principled_2_transmission",
       single("BsdfPrincipled",
              {{"Base Color", rgb(0.7f, 0.8f, 0.9f)},
               {"Transmission Weight", 0.8f},
               {"Roughness", 0.3f},
               {"IOR", 1.4f},
               {"Coat Weight", 0.5f}},
              {{"generation", 2.0f}, {"distribution", std::string("MULTI_GGX")}}),
       k_round_delta);
  const Numbers radius = {0.3f, 0.15f, 0.05f};
  ball("subsurface",
       single("SubsurfaceScattering", {{"Color", rgb(0.8f, 0.6f, 0.4f)}, {"Radius", radius}, {"Scale", 1.0f}}),
       k_round_delta);
  ball("subsurface_2",
       single("SubsurfaceScattering", {{"Color", rgb(0.8f, 0.6f, 0.4f)},
                                       {"Radius", radius},
                                       {"Scale", 2.0f},
                                       {"Anisotropy", 0.6f},
                                       {"Roughness", 0.5f}}),
       k_round_delta);
  ball("subsurface_profile",
       single("SubsurfaceScattering", {{"Color", rgb(0.8f, 0.6f, 0.4f)}, {"Radius", radius}, {"Scale", 2.0f}},
              {{"falloff", std::string("BURLEY")}}),
       k_round_delta);
  ball("subsurface_principled_1",
       single("BsdfPrincipled",
              {{"Base Color", rgb(0.7f, 0.4f, 0.3f)},
               {"Subsurface", 0.7f},
               {"Subsurface Color", rgb(0.9f, 0.5f, 0.4f)},
               {"Subsurface Radius", radius},
               {"Roughness", 0.35f}},
              {{"generation", 1.0f}, {"distribution", std::string("GGX")}}),
       k_round_delta);
  ball("subsurface_principled_2",
       single("BsdfPrincipled",
              {{"Base Color", rgb(0.7f, 0.4f, 0.3f)},
               {"Subsurface Weight", 0.7f},
               {"Subsurface Radius", radius},
               {"Subsurface Scale", 1.0f},
               {"Roughness", 0.35f}},
              {{"generation", 2.0f}, {"distribution", std::string("GGX")}}),
       k_round_delta);
  const Numbers white = rgb(0.9f, 0.9f, 0.9f);
  for (const auto& [name, roughness] : {std::pair{"film_glass_0", 0.0f}, {"film_glass_3", 0.3f}})
    ball(name,
         single("BsdfGlass",
                {{"Color", white}, {"Roughness", roughness}, {"IOR", 1.5f}, {"Thin Film Thickness", 400.0f}},
                {{"distribution", std::string("GGX")}}),
         k_round_delta);
  ball("film_metal", single("BsdfMetallic", {{"Roughness", 0.35f}, {"Thin Film Thickness", 400.0f}}), k_round);
  ball("thin_wall",
       single("BsdfPrincipled",
              {{"Base Color", rgb(0.7f, 0.8f, 0.9f)},
               {"Thin Wall", 1.0f},
               {"Transmission Weight", 0.6f},
               {"Roughness", 0.6f},
               {"Subsurface Weight", 0.7f},
               {"Diffuse Roughness", 0.5f}},
              {{"generation", 2.0f}, {"distribution", std::string("MULTI_GGX")}}),
       k_round_delta);
  ball("thin_wall_smooth",
       single("BsdfPrincipled",
              {{"Base Color", rgb(0.7f, 0.8f, 0.9f)},
               {"Thin Wall", 1.0f},
               {"Transmission Weight", 0.8f},
               {"Roughness", 0.0f}},
              {{"generation", 2.0f}, {"distribution", std::string("MULTI_GGX")}}),
       k_round_delta);
  GraphMaker portal;
  {
    const int place = portal.add("CombineXYZ", {{"X", 0.5f}, {"Y", -0.5f}, {"Z", 0.8f}});
    const int through = portal.add("BsdfRayPortal", {{"Color", white}, {"Position", Link{place, "Vector"}}});
    const int lambert = portal.add("BsdfDiffuse", {{"Color", white}});
    portal.add("MixShader", {{"Fac", 0.5f}, {"Shader", Link{through, "BSDF"}}, {"Shader_001", Link{lambert, "BSDF"}}});
  }
  ball("portal", portal.surface(), k_round_delta);
  // The same on the corridor's floor, where photons serve too.
  cases.push_back({"lobe_flat_glossy", lit_corridor(glossy(0.5f)), k_all});
  // Lobes without a cosine, which merging meets with photons that grow rare where they count as much.
  cases.push_back(
      {"lobe_flat_toon",
       lit_corridor(single("BsdfToon", {{"Color", rgb(0.8f, 0.5f, 0.4f)}, {"Size", 0.9f}, {"Smooth", 0.1f}})),
       k_flat_delta});
  cases.push_back(
      {"lobe_flat_hair",
       lit_corridor(single("BsdfHair", {{"Color", rgb(0.8f, 0.5f, 0.4f)}, {"RoughnessU", 0.4f}, {"RoughnessV", 1.0f}},
                           {{"component", std::string("Reflection")}})),
       k_flat_delta});
  cases.push_back(
      {"lobe_flat_principled_hair",
       lit_corridor(single("BsdfHairPrincipled",
                           {{"Color", rgb(0.6f, 0.4f, 0.3f)}, {"Roughness", 0.4f}, {"Radial Roughness", 0.6f}})),
       k_flat_delta});
  cases.push_back({"lobe_flat_subsurface",
                   lit_corridor(single("SubsurfaceScattering", {{"Color", rgb(0.8f, 0.6f, 0.4f)}, {"Radius", radius}})),
                   k_camera_scatters});
  cases.push_back({"lobe_flat_mirror_wall", lit_corridor(diffuse(Color(0.7f)), glossy(0.0f)), k_flat_delta});
  cases.push_back({"lobe_flat_mirror_and_diffuse_wall",
                   lit_corridor(diffuse(Color(0.7f)), combined("MixShader", diffuse(Color(0.8f)), glossy(0.0f))),
                   k_flat_delta});
  cases.push_back({"lobe_flat_glossy_wall", lit_corridor(diffuse(Color(0.7f)), glossy(0.5f)), k_all_and_vpl});
  return cases;
}

std::vector<IntegratorCase> limit_cases() {
  std::vector<IntegratorCase> cases;
  const auto rich = [] {
    SceneMaker maker = lit_corner(combined("MixShader", diffuse(Color(0.8f)), glossy(0.3f)));
    maker.material("glass", glass(0.3f)).material("white", combined("MixShader", diffuse(Color(0.8f)), glossy(0.4f)));
    maker.sphere("glass", Vec3(-0.8f, -0.6f, -2.9f), 0.35f, 10, "glass");
    maker.settings.max_bounces = maker.settings.diffuse_bounces = maker.settings.glossy_bounces =
        maker.settings.transmission_bounces = 6;
    return maker;
  };
  for (int limit = 0; limit <= 2; ++limit) {
    const std::string suffix = "_" + std::to_string(limit);
    for (const auto& [name, member] : {std::pair{"total", &Settings::max_bounces},
                                       {"diffuse", &Settings::diffuse_bounces},
                                       {"glossy", &Settings::glossy_bounces},
                                       {"transmission", &Settings::transmission_bounces}}) {
      SceneMaker maker = rich();
      maker.settings.*member = limit;
      cases.push_back({std::string("limit_") + name + suffix, maker, k_round});
    }
    SceneMaker flat = lit_corridor(combined("MixShader", diffuse(Color(0.8f)), glossy(0.5f)),
                                   combined("MixShader", diffuse(Color(0.8f)), glossy(0.5f)));
    flat.settings.diffuse_bounces = limit;
    flat.settings.glossy_bounces = 2 - limit;
    cases.push_back({"limit_flat" + suffix, flat, k_all});
    SceneMaker sheets = rich();
    sheets.material("t", combined("MixShader", transparent(Color(0.9f)), diffuse(Color(0.8f))));
    for (int i = 0; i < 3; ++i)
      quad(sheets, "t" + std::to_string(i), {-1.5f, 1.0f + 0.2f * static_cast<float>(i), -4},
           {1.5f, 1.0f + 0.2f * static_cast<float>(i), -4}, {1.5f, 1.1f + 0.2f * static_cast<float>(i), -2}, "t");
    sheets.settings.transparent_bounces = limit;
    cases.push_back({"limit_transparent" + suffix, sheets, k_round});
    SceneMaker lamps = rich();
    Light light = area(AreaShape::square, 1.5f, 1.5f, 60.0f);
    light.max_bounces = limit;
    lamps.light("l", light, aimed({0.6f, 2.3f, -2.6f}, {0.2f, -1, -3.4f}));
    cases.push_back({"limit_lamp_bounces" + suffix, lamps, k_round});
    SceneMaker flat_lamp = corridor();
    flat_lamp.light("l", light, k_above);
    cases.push_back({"limit_lamp_bounces_flat" + suffix, flat_lamp, k_all});
  }
  for (const bool reflective : {false, true}) {
    SceneMaker maker = rich();
    maker.material("ball", glossy(0.2f));
    (reflective ? maker.settings.caustics_reflective : maker.settings.caustics_refractive) = false;
    // Light walks do not know what scattered before: they end at glossy surfaces.
    cases.push_back(
        {std::string("limit_no_caustics_") + (reflective ? "reflective" : "refractive"), maker, k_round_delta});
    SceneMaker flat = lit_corridor(diffuse(Color(0.7f)), combined("MixShader", diffuse(Color(0.6f)), glossy(0.3f)));
    (reflective ? flat.settings.caustics_reflective : flat.settings.caustics_refractive) = false;
    cases.push_back({std::string("limit_no_caustics_flat_") + (reflective ? "reflective" : "refractive"),
                     flat,
                     {"BPT", "VCM", "BPM"}});
  }
  return cases;
}

std::vector<IntegratorCase> linking_cases() {
  std::vector<IntegratorCase> cases;
  const std::vector<std::string> reflected{"BPT", "VCM"};
  // The corridor with a screen between its light and the floor, in sets by what is asked of them.
  const auto add = [&](const std::string& name, const Light* light, const std::vector<std::string>& receivers,
                       const std::vector<std::string>& blockers, const std::vector<std::string>& integrators,
                       Graph wall = diffuse(Color(0.5f, 0.6f, 0.7f)), Graph screen = diffuse(Color(0.6f))) {
    SceneMaker maker = corridor(diffuse(Color(0.7f, 0.6f, 0.5f)), std::move(wall));
    maker.material("screen", std::move(screen));
    quad(maker, "screen", {-1.6f, 0.2f, -2.6f}, {1.2f, 0.2f, -2.6f}, {1.2f, 2.6f, -2.4f}, "screen");
    if (light) {
      maker.light("l", *light, k_above);
    } else {
      maker.material("e", emission(Color(1.0f, 0.8f, 0.6f), 6.0f));
      quad(maker, "l", {-0.8f, 1.6f, -1.5f}, {0.2f, 1.6f, -1.5f}, {0.2f, 2.6f, -1.2f}, "e");
    }
    Light other = lamp(LightType::point, 60.0f);
    other.radius_m = 0.2f;  // path tracing would not see it in mirrors without
    maker.light("other", other, aimed({0.5f, -2, -1}, {0, 0, -4}));
    LightLinking& emitted = maker.object("l").light_linking;
    if (!receivers.empty()) emitted.receivers = "r";
    if (!blockers.empty()) emitted.blockers = "b";
    for (const std::string& id : receivers)
      if (id != "none") maker.object(id).light_linking.receives = {"r"};
    for (const std::string& id : blockers)
      if (id != "none") maker.object(id).light_linking.blocks = {"b", "unused"};
    cases.push_back({"linking_" + name, maker, integrators});
  };
  const Light square = area(AreaShape::square, 1.0f, 1.0f, 60.0f), point = lamp(LightType::point, 60.0f);
  Light sun = lamp(LightType::sun, 2.0f);
  sun.angle_rad = 0.5f;
  add("area_that_reaches_the_walls", &square, {"left", "right", "screen"}, {}, k_all);
  add("area_that_reaches_the_floor", &square, {"floor"}, {}, k_all);
  add("mesh_that_reaches_one_wall", nullptr, {"right"}, {}, k_all);
  // Photons are few where most light walks begin at what reaches nothing.
  add("sun_that_reaches_nothing", &sun, {"none"}, {}, k_round);
  add("area_that_nothing_blocks", &square, {}, {"none"}, k_all_and_vpl);
  add("point_through_the_screen", &point, {}, {"floor", "left", "right"}, k_all);
  add("sun_that_the_screen_blocks", &sun, {}, {"screen"}, k_all);
  add("mesh_through_the_screen", nullptr, {}, {"floor", "left", "right", "l"}, k_all);
  add("mesh_reaches_the_floor_through_the_screen", nullptr, {"floor"}, {"left", "right"}, k_all);
  add("area_through_half_transparent_screen", &square, {"floor", "screen"}, {"floor", "screen"}, k_all,
      diffuse(Color(0.5f, 0.6f, 0.7f)), combined("MixShader", transparent(Color(0.9f)), diffuse(Color(0.8f))));
  add("area_past_half_transparent_screen", &square, {}, {"floor"}, k_all, diffuse(Color(0.5f, 0.6f, 0.7f)),
      combined("MixShader", transparent(Color(0.9f)), diffuse(Color(0.8f))));
  add("area_through_half_transparent_screen_that_it_does_not_reach", &square, {"floor", "left"}, {}, k_all,
      diffuse(Color(0.5f, 0.6f, 0.7f)), combined("MixShader", transparent(Color(0.9f)), diffuse(Color(0.8f))));
  for (const Light* light : {&square, static_cast<const Light*>(nullptr)})
    add(light ? "area_seen_in_mirrors" : "mesh_seen_in_gloss", light, {"floor", "left"}, {"right", "floor"}, reflected,
        glossy(light ? 0.0f : 0.3f));
  SceneMaker many = corridor();
  for (int i = 0; i < 40; ++i) {
    const float x = -2.2f + 4.4f * static_cast<float>((i * 7) % 20) / 19.0f,
                y = -2.6f + 5.2f * static_cast<float>((i * 13) % 40) / 39.0f;
    const float z = std::fabs(y) < 1.5f && std::fabs(x) < 1.5f ? 0.5f : -1.2f;
    const std::string id = "l" + std::to_string(i);
    many.light(id, i % 3 == 0 ? lamp(LightType::point, 3.0f) : area(AreaShape::square, 0.2f, 0.2f, 3.0f),
               aimed({x, y, z}, {x * 0.3f, y * 0.3f, -4}));
    if (i % 2) many.object(id).light_linking.receivers = i % 4 == 1 ? "floor" : "walls";
  }
  many.light("sun", sun, aimed({1, -1, 3}, {0, 0, 0}));
  many.object("sun").light_linking.receivers = "walls";
  many.object("floor").light_linking.receives = {"floor"};
  many.object("left").light_linking.receives = {"walls"};
  many.object("right").light_linking.receives = {"walls", "floor"};
  cases.push_back({"linking_many", many, k_all});
  return cases;
}

std::vector<IntegratorCase> integrator_cases() {
  std::vector<IntegratorCase> cases;
  for (auto list : {light_cases, camera_cases, lobe_cases, surface_cases, gloss_cases, limit_cases, linking_cases})
    for (IntegratorCase& one : list()) cases.push_back(std::move(one));
  return cases;
}

}  // namespace lambent::test
