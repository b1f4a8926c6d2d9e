#include "server/daemon/array_store.h"

#include <gtest/gtest.h>

#include "server/daemon/memory_budget.h"

namespace lambent {
namespace {

ArrayPointer number(float value) { return make_array(ElementType::f32, {1}, &value); }

TEST(ArrayStore, keeps_what_is_used_and_drops_the_rest_after_its_epoch) {
  ArrayStore store;
  const ArrayPointer used = number(1);
  const std::string unused_hash = number(2)->hash;
  store.add({used, number(2)});
  store.sweep(1);
  store.sweep(1);
  EXPECT_TRUE(store.find(unused_hash)) << "the epoch may have more transactions";
  store.sweep(2);
  EXPECT_FALSE(store.find(unused_hash));
  EXPECT_TRUE(store.find(used->hash));
  EXPECT_EQ(store.missing({used->hash, unused_hash}), std::vector<std::string>{unused_hash});
}

TEST(ArrayStore, a_render_s_start_drops_everything_unused) {
  ArrayStore store;
  const ArrayPointer used = number(1);
  store.add({used, number(2)});
  store.sweep_all();
  EXPECT_EQ(store.size(), 1u);
}

TEST(MemoryBudget, is_bounded_by_its_own_limit_and_its_parent_s_and_gives_back) {
  const auto all = MemoryBudget::create(100);
  const auto one = MemoryBudget::create(80, all), two = MemoryBudget::create(80, all);
  auto first = one->reserve(70);
  EXPECT_TRUE(first);
  EXPECT_FALSE(one->reserve(20));
  EXPECT_FALSE(two->reserve(40));
  EXPECT_EQ(two->used(), 0u);
  EXPECT_TRUE(two->reserve(30));
  first = nullptr;
  EXPECT_EQ(all->used(), 0u);
  EXPECT_FALSE(one->reserve(~uint64_t(0)));
  EXPECT_TRUE(one->reserve(80));
}

}  // namespace
}  // namespace lambent
