#include "engine/path/photon.h"

#include <gtest/gtest.h>

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <numeric>
#include <random>
#include <thread>
#include <tuple>

#include "engine/path/photon_map.h"
#include "engine/sampling/sampler.h"
#include "engine/sampling/warp.h"

namespace lambent {
namespace {

TEST(PackedColor, keeps_flux_of_any_scale_to_8e_6_of_its_largest_channel) {
  RandomStream random(1);
  for (int i = 0; i < 100000; ++i) {
    const float scale = std::exp(140.0f * (random.next_1d() - 0.5f));  // 4e-31 to 2.5e30
    const Color color(scale * (2.0f * random.next_1d() - 1.0f), scale * (2.0f * random.next_1d() - 1.0f),
                      scale * random.next_1d());
    const Color found = PackedColor::of(color).unpack();
    const float largest = max_component(abs(color));
    ASSERT_LE(max_component(abs(found - color)), 8e-6f * largest) << color << " became " << found;
  }
}

TEST(PackedColor, rounds_without_bias) {
  RandomStream random(2);
  double error = 0.0;
  constexpr int k_count = 200000;
  for (int i = 0; i < k_count; ++i) {
    const Color color(1.0f, 0.01f + 0.5f * random.next_1d(), 0.0f);
    error += static_cast<double>(PackedColor::of(color).unpack().y - color.y);
  }
  // A step is 2^-17 of the exponent's power of two: 1.5e-5, spread 4.4e-6; five standard errors.
  EXPECT_NEAR(error / k_count, 0.0, 5.0 * 4.4e-6 / std::sqrt(k_count));
}

TEST(PackedColor, of_black_and_of_what_is_not_finite_is_black) {
  for (const float bad : {0.0f, -0.0f, k_infinity, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_EQ(PackedColor::of(Color(bad)).unpack(), Color(0.0f));
}

TEST(PackDirection, is_off_by_at_most_1e_4) {
  RandomStream random(3);
  for (int i = 0; i < 100000; ++i) {
    const Vec3 w = sample_uniform_sphere(random.next_2d());
    const Vec3 found = unpack_direction(pack_direction(w));
    ASSERT_NEAR(length(found), 1.0f, 1e-6f);
    ASSERT_LE(length(found - w), 1e-4f) << w;
  }
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)})
    EXPECT_LE(length(unpack_direction(pack_direction(axis)) - axis), 1e-4f) << axis;
}

/// Batches of one walk a photon. Positions uniform in a box, with a crowd in one place and some outside of it.
std::vector<PhotonBatch> random_batches(int batches, int photons_each, uint64_t seed) {
  RandomStream random(seed);
  std::vector<PhotonBatch> result(static_cast<size_t>(batches));
  for (PhotonBatch& batch : result)
    for (int i = 0; i < photons_each; ++i) {
      PhotonRecord light, record;
      record.depth = 1;
      record.own = random.next_1d();
      batch.records.push_back(light);
      Vec3 p(random.next_1d() * 4.0f - 1.0f, random.next_1d() * 2.0f, random.next_1d());
      if (i % 5 == 0) p = Vec3(0.5f) + p * 0.01f;
      if (i % 17 == 0) p = p * 30.0f - Vec3(20.0f);  // far outside of the bounds
      batch.photons.push_back({p, pack_direction(sample_uniform_sphere(random.next_2d())),
                               PackedColor::of(Color(record.own)), pack_direction(Vec3(0, 0, 1)),
                               static_cast<uint32_t>(batch.records.size())});
      batch.records.push_back(record);
    }
  return result;
}

std::vector<PhotonBatch*> pointers(std::vector<PhotonBatch>& batches) {
  std::vector<PhotonBatch*> result;
  for (PhotonBatch& batch : batches) result.push_back(&batch);
  return result;
}

const Bounds3 k_bounds{Vec3(-1, 0, 0), Vec3(3, 2, 1)};

using Found = std::vector<std::tuple<float, float, float, float>>;  ///< position and the record's own

Found query(const PhotonMap& map, const Vec3& p, float radius, size_t most = 1u << 30, float u = 0.0f) {
  Found found;
  map.query(p, radius, most, u, [&](const Photon& photon, float scale) {
    EXPECT_EQ(scale, 1.0f);
    found.emplace_back(photon.p_world.x, photon.p_world.y, photon.p_world.z, map.record(photon.record).own);
  });
  return found;
}

TEST(PhotonMap, finds_exactly_the_photons_within_the_radius) {
  std::vector<PhotonBatch> batches = random_batches(7, 2000, 4);
  std::vector<Photon> all;
  std::vector<float> own;
  for (const PhotonBatch& batch : batches)
    for (const Photon& photon : batch.photons) {
      all.push_back(photon);
      own.push_back(batch.records[photon.record].own);
    }
  for (const float cell : {0.02f, 0.1f, 1.0f, 1e-9f, 1e9f}) {
    std::vector<PhotonBatch> copy = batches;
    PhotonMap map;
    map.build(pointers(copy), cell, k_bounds, 14000, 2, {});
    ASSERT_EQ(map.size(), all.size());
    RandomStream random(5);
    // Radii of some cells at most: a query visits them all.
    for (int i = 0; i < 200; ++i) {
      const float radius = std::min(0.5f, 4.0f * std::max(cell, 4.0f * 0x1p-19f)) * random.next_1d();
      const Vec3 p = i % 2 ? all[random.next_u32() % all.size()].p_world
                           : Vec3(random.next_1d() * 4.0f - 1.0f, random.next_1d() * 2.0f, random.next_1d());
      Found expected;
      for (size_t k = 0; k < all.size(); ++k)
        if (length_squared(all[k].p_world - p) < radius * radius)
          expected.emplace_back(all[k].p_world.x, all[k].p_world.y, all[k].p_world.z, own[k]);
      Found found = query(map, p, radius);
      std::sort(expected.begin(), expected.end());
      std::sort(found.begin(), found.end());
      ASSERT_EQ(found, expected) << "cell " << cell << " radius " << radius;
    }
  }
}

TEST(PhotonMap, knows_whether_a_photon_came_straight_from_the_light_or_by_deltas_alone) {
  // Walks whose events at depths 1, 2 ... had a density (1) or were deltas (0); the last depth is the photon's own.
  const std::vector<std::pair<std::vector<int>, bool>> walks{{{1}, true},       {{0}, true},     {{0, 1}, true},
                                                             {{0, 0, 1}, true}, {{1, 0}, false}, {{0, 1, 0}, false},
                                                             {{1, 1}, false}};
  for (const auto& [events, straight] : walks) {
    PhotonBatch batch;
    batch.records.emplace_back();
    for (size_t i = 0; i < events.size(); ++i) {
      PhotonRecord record;
      record.depth = static_cast<uint16_t>(i + 1);
      if (events[i]) record.flags = k_record_connectible;
      if (i > 0) {  // a way that the walk did not take lies between: of transparent surfaces
        PhotonRecord other = record;
        other.flags ^= k_record_connectible;
        batch.records.push_back(other);
      }
      batch.records.push_back(record);
    }
    batch.photons.push_back({Vec3(0.5f), pack_direction(Vec3(0, 0, 1)), PackedColor::of(Color(1.0f)),
                             pack_direction(Vec3(0, 0, 1)), static_cast<uint32_t>(batch.records.size() - 1)});
    PhotonBatch* const one[] = {&batch};
    PhotonMap map;
    map.build(one, 0.1f, k_bounds, 1, 1);
    int seen = 0;
    map.query(Vec3(0.5f), 0.1f, 16, 0.0f, [&](const Photon& photon, float) {
      ++seen;
      EXPECT_EQ(map.came_straight(photon), straight) << events.size();
    });
    EXPECT_EQ(seen, 1);
  }
}

TEST(PhotonMap, a_cap_keeps_the_expected_sum) {
  std::vector<PhotonBatch> batches = random_batches(3, 3000, 6);
  PhotonMap map;
  map.build(pointers(batches), 0.1f, k_bounds, 9000, 1, {});
  const Vec3 p(0.5f);
  double all = 0.0;
  size_t count = 0;
  map.query(p, 0.1f, 1u << 30, 0.0f, [&](const Photon& photon, float) {
    all += static_cast<double>(map.record(photon.record).own);
    ++count;
  });
  ASSERT_GT(count, 1000u);
  for (const size_t most : {500u, 64u, 1u}) {
    // u stratified so finely that every place to start from comes equally often.
    double mean = 0.0;
    size_t looked_at = 0;
    constexpr int k_steps = 1 << 14;
    for (int k = 0; k < k_steps; ++k)
      map.query(p, 0.1f, most, (static_cast<float>(k) + 0.5f) / k_steps, [&](const Photon& photon, float scale) {
        mean += static_cast<double>(scale * map.record(photon.record).own) / k_steps;
        ++looked_at;
      });
    EXPECT_NEAR(mean, all, 5e-3 * all) << "at most " << most;
    EXPECT_LE(looked_at, most * k_steps);
  }
}

TEST(PhotonMap, content_and_order_depend_on_neither_the_order_of_batches_nor_threads) {
  const std::vector<PhotonBatch> batches = random_batches(9, 700, 7);
  std::vector<Found> references;
  for (const int threads : {1, 2, 8}) {
    for (const bool reversed : {false, true}) {
      std::vector<PhotonBatch> copy = batches;
      if (reversed) std::reverse(copy.begin(), copy.end());
      PhotonMap map;
      map.build(pointers(copy), 0.2f, k_bounds, 6300, threads, {});
      std::vector<Found> found;
      for (const Vec3& p : {Vec3(0.5f), Vec3(1.5f, 1.0f, 0.3f), Vec3(0.0f)}) found.push_back(query(map, p, 0.4f));
      ASSERT_GT(found[0].size(), 100u);
      if (references.empty()) references = found;
      EXPECT_EQ(found, references) << threads << " threads" << (reversed ? ", reversed" : "");
    }
  }
}

/// Photons in one point, told apart by their flux, in an order of their own for each seed.
PhotonBatch crowd(int count, uint32_t seed) {
  std::vector<int> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  PhotonBatch batch;
  for (const int i : order) {
    PhotonRecord record;
    record.depth = 1;
    batch.records.push_back(record);
    batch.photons.push_back(
        {Vec3(0.3f), 1, PackedColor{static_cast<uint64_t>(i)}, 2, static_cast<uint32_t>(batch.records.size() - 1)});
  }
  return batch;
}

TEST(PhotonMap, a_crowded_cell_is_sorted_whatever_the_order_and_threads) {
  constexpr int k_count = 300000;
  for (const int threads : {1, 2}) {
    std::vector<PhotonBatch> batches{crowd(k_count, static_cast<uint32_t>(threads))};
    PhotonMap map;
    map.build(pointers(batches), 0.1f, k_bounds, k_count, threads, {});
    uint64_t next = 0;
    bool sorted = true;
    map.query(Vec3(0.3f), 0.01f, 1u << 30, 0.0f,
              [&](const Photon& photon, float) { sorted = sorted && photon.flux.bits == next++; });
    EXPECT_TRUE(sorted) << threads << " threads";
    EXPECT_EQ(next, static_cast<uint64_t>(k_count));
  }
}

double cpu_s(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

TEST(PhotonMap, building_ends_within_50_ms_of_work_when_it_is_cancelled) {
  constexpr int k_count = 2000000;  // sorting them at once would take half a second
  const PhotonBatch all = crowd(k_count, 3);
  clockid_t clock;
  ASSERT_EQ(pthread_getcpuclockid(pthread_self(), &clock), 0);
  bool was_cut = false;
  for (const double work_s : {0.0, 0.05, 0.1, 0.2, 0.3}) {
    std::vector<PhotonBatch> batches{all};
    PhotonMap map;
    CancelFlag cancel;
    std::atomic<bool> done{false};
    double cancelled_s = 0.0;
    const double start_s = cpu_s(clock);
    std::thread canceller([&] {
      while (cpu_s(clock) - start_s < work_s && !done) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      cancelled_s = cpu_s(clock);
      cancel.cancel();
    });
    map.build(pointers(batches), 0.1f, k_bounds, k_count, 1, cancel);
    const double end_s = cpu_s(clock);
    done = true;
    canceller.join();
    was_cut = was_cut || map.empty();
    EXPECT_LT(end_s - cancelled_s, 0.05) << "cancelled after " << work_s << " s of work";
  }
  EXPECT_TRUE(was_cut);
}

TEST(PhotonMap, of_nothing_answers_nothing) {
  PhotonMap map;
  map.build({}, 0.1f, Bounds3(), 0, 1, {});
  EXPECT_TRUE(map.empty());
  EXPECT_TRUE(query(map, Vec3(0.0f), 1.0f).empty());
}

TEST(PhotonMap, a_million_photons_in_one_point_are_looked_at_in_part) {
  std::vector<PhotonBatch> batches(1);
  for (int i = 0; i < 1000000; ++i) {
    PhotonRecord record;
    record.depth = 1;
    record.own = 1.0f;
    batches[0].records.push_back(record);
    batches[0].photons.push_back({Vec3(0.3f), 1, PackedColor::of(Color(1.0f)), 2, static_cast<uint32_t>(i)});
  }
  PhotonMap map;
  map.build(pointers(batches), 0.1f, k_bounds, 1000000, 2, {});
  double sum = 0.0;
  size_t looked_at = 0;
  map.query(Vec3(0.3f), 0.01f, 2048, 0.5f, [&](const Photon&, float scale) {
    sum += static_cast<double>(scale);
    ++looked_at;
  });
  EXPECT_LE(looked_at, 2048u);
  EXPECT_NEAR(sum, 1e6, 1e3);
}

}  // namespace
}  // namespace lambent
