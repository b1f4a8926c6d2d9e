// Choosing light vertices must not change what connections to all of them bring on average.
#include "engine/integrators/bidirectional/vertex_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/sampling/sampler.h"

namespace lambent::bidirectional {
namespace {

std::vector<PlaceTree::Place> places_in_a_box(int count, RandomStream& random) {
  std::vector<PlaceTree::Place> places;
  for (int i = 0; i < count; ++i) {
    const Vec3 p(random.next_1d(), random.next_1d(), random.next_1d());
    places.push_back({p, random.next_1d() < 0.5f ? Vec3(0.0f, 0.0f, 1.0f) : Vec3(1.0f, 0.0f, 0.0f)});
  }
  return places;
}

TEST(PlaceTree, has_about_as_many_places_in_each_leaf) {
  RandomStream random(1);
  const std::vector<PlaceTree::Place> places = places_in_a_box(4096, random);
  const PlaceTree tree(places, 1.0f, 64);
  ASSERT_EQ(tree.leaves(), 64);
  std::vector<int> counts(64);
  for (const PlaceTree::Place& place : places)
    ++counts[static_cast<size_t>(tree.leaf_at(place.p_world, place.ng_world))];
  EXPECT_EQ(*std::min_element(counts.begin(), counts.end()), 64);
  EXPECT_EQ(*std::max_element(counts.begin(), counts.end()), 64);
}

TEST(PlaceTree, tells_the_sides_of_a_wall_apart) {
  std::vector<PlaceTree::Place> places(64);
  for (size_t i = 0; i < places.size(); ++i) places[i].ng_world = Vec3(0.0f, 0.0f, i % 2 == 0 ? 1.0f : -1.0f);
  const PlaceTree tree(places, 1.0f, 8);
  EXPECT_EQ(tree.leaves(), 2);
  EXPECT_NE(tree.leaf_at(Vec3(0.0f), Vec3(0.0f, 0.0f, 1.0f)), tree.leaf_at(Vec3(0.0f), Vec3(0.0f, 0.0f, -1.0f)));
}

TEST(PlaceTree, of_places_that_do_not_differ_or_of_none_is_one_leaf) {
  EXPECT_EQ(PlaceTree({}, 1.0f, 8).leaves(), 1);
  EXPECT_EQ(PlaceTree(std::vector<PlaceTree::Place>(100), 0.0f, 8).leaves(), 1);
  EXPECT_EQ(PlaceTree({}, 0.0f, 8).leaf_at(Vec3(k_infinity), Vec3(0.0f)), 0);
}

TEST(PlaceTree, where_most_places_share_a_coordinate_has_a_leaf_for_each) {
  std::vector<PlaceTree::Place> places(100);
  for (size_t i = 90; i < 100; ++i) places[i].p_world.x = static_cast<float>(i);
  const PlaceTree tree(places, 50.0f, 16);
  EXPECT_GT(tree.leaves(), 1);
  for (const PlaceTree::Place& place : places) {
    const int leaf = tree.leaf_at(place.p_world, place.ng_world);
    EXPECT_TRUE(leaf >= 0 && leaf < tree.leaves());
  }
}

TEST(ChooseWalks, takes_each_walk_as_often_as_its_worth_says) {
  RandomStream random(2);
  std::vector<PoolCandidate> candidates;
  double all = 0.0;
  for (int i = 0; i < 50; ++i) {
    candidates.push_back({i, 0, i % 7 == 0 ? 0.0 : std::exp(8.0 * static_cast<double>(random.next_1d()))});
    all += candidates.back().worth;
  }
  constexpr int k_rounds = 1000, k_count = 20;
  std::vector<double> taken(candidates.size());
  for (int round = 0; round < k_rounds; ++round) {
    int of_round = 0;
    for (const ChosenWalk& walk : choose_walks(candidates, k_count, (static_cast<float>(round) + 0.5f) / k_rounds)) {
      taken[static_cast<size_t>(walk.x)] += static_cast<double>(walk.at.size());
      of_round += static_cast<int>(walk.at.size());
      for (const double at : walk.at) EXPECT_TRUE(at >= 0.0 && at < candidates[static_cast<size_t>(walk.x)].worth);
    }
    ASSERT_NEAR(of_round, k_count, 1);
  }
  for (size_t i = 0; i < candidates.size(); ++i)
    EXPECT_NEAR(taken[i] / k_rounds, k_count * candidates[i].worth / all, 2.0 / k_rounds) << i;
}

TEST(ChooseWalks, of_nothing_takes_nothing) {
  EXPECT_TRUE(choose_walks({}, 8, 0.5f).empty());
  const std::vector<PoolCandidate> worthless(3);
  EXPECT_TRUE(choose_walks(worthless, 8, 0.5f).empty());
}

/// A guide of two regions of what is seen first (left and right of x = 0.5), two leaves of light likewise, and so of
/// one region of what is met later.
ConnectionGuide guide_of_two() {
  const std::vector<PlaceTree::Place> two{{Vec3(0.0f), Vec3(0.0f)}, {Vec3(1.0f, 0.0f, 0.0f), Vec3(0.0f)}};
  return ConnectionGuide(PlaceTree(two, 1.0f, 2), PlaceTree(two, 1.0f, 2), {9.0, 1.0, 0.0, 4.0, 2.0, 3.0}, {10.0, 30.0},
                         {5.0, 10.0}, 4);
}

TEST(ConnectionGuide, counts_how_often_a_usual_vertex_is_chosen) {
  const ConnectionGuide guide = guide_of_two();
  // Of a walk, that is of (5 vertices of 2 W and 10 of 3 W) / 4, one vertex is chosen.
  ASSERT_EQ(guide.regions(), 3);
  EXPECT_EQ(guide.later_region(1), 2);
  for (int region = 0; region < guide.regions(); ++region)
    EXPECT_NEAR(guide.chosen(region, 0) * 5.0f / 4.0f + guide.chosen(region, 1) * 10.0f / 4.0f, 1.0f, 1e-5f);
  EXPECT_NEAR(guide.chosen(0, 0) / guide.chosen(0, 1),
              2.0f * guide.worth_per_watt(0, 0) / (3.0f * guide.worth_per_watt(0, 1)), 1e-5f);
  EXPECT_GT(guide.worth_per_watt(1, 0), 0.0f) << "what brought nothing must stay possible";
}

TEST(ConnectionGuide, without_worth_is_empty) {
  EXPECT_TRUE(ConnectionGuide(PlaceTree(), PlaceTree(), {0.0, 0.0}, {1.0}, {1.0}, 1).empty());
  EXPECT_TRUE(ConnectionGuide(PlaceTree(), PlaceTree(), {1.0, std::nan("")}, {1.0}, {1.0}, 1).empty());
}

}  // namespace
}  // namespace lambent::bidirectional
