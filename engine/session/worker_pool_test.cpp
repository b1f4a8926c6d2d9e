#include "engine/session/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>

namespace lambent {
namespace {

using namespace std::chrono_literals;

/// A given number of pieces of about a millisecond.
class Pieces : public WorkSource {
 public:
  explicit Pieces(int count, int limit = 0) : left_(count), limit_(limit) {}
  bool work(int worker) override {
    if (left_.fetch_sub(1) <= 0) return false;
    const int inside = ++inside_;
    for (int seen = most_inside.load(); seen < inside && !most_inside.compare_exchange_weak(seen, inside);) {
    }
    std::this_thread::sleep_for(1ms);
    --inside_;
    ++done;
    return true;
  }
  int worker_limit() const override { return limit_; }
  void refill(int count) { left_ = count; }
  bool wait_for(int count) const {
    for (int i = 0; i < 5000 && done < count; ++i) std::this_thread::sleep_for(1ms);
    return done == count;
  }

  std::atomic<int> done{0}, most_inside{0};

 private:
  std::atomic<int> left_, inside_{0};
  const int limit_;
};

TEST(WorkerPool, does_every_piece_once_and_again_after_a_wake) {
  WorkerPool pool(4);
  Pieces pieces(50);
  pool.add(&pieces);
  EXPECT_TRUE(pieces.wait_for(50));
  pieces.refill(20);
  pool.wake();
  EXPECT_TRUE(pieces.wait_for(70));
  pool.remove(&pieces);
}

TEST(WorkerPool, sources_share_the_workers_fairly) {
  WorkerPool pool(2);
  Pieces large(1000000), small(40);
  pool.add(&large);
  std::this_thread::sleep_for(20ms);
  pool.add(&small);
  const int before = large.done;
  ASSERT_TRUE(small.wait_for(40));
  const int meanwhile = large.done - before;
  pool.remove(&large);
  pool.remove(&small);
  EXPECT_GT(meanwhile, 10) << "the large source must go on";
  EXPECT_LT(meanwhile, 160) << "the small source must get its turn";
}

TEST(WorkerPool, a_source_may_limit_its_workers) {
  WorkerPool pool(4);
  Pieces limited(60, 1);
  pool.add(&limited);
  EXPECT_TRUE(limited.wait_for(60));
  pool.remove(&limited);
  EXPECT_EQ(limited.most_inside, 1);
}

TEST(WorkerPool, nobody_is_inside_a_source_after_its_removal) {
  WorkerPool pool(4);
  for (int i = 0; i < 50; ++i) {
    auto pieces = std::make_unique<Pieces>(1000);
    pool.add(pieces.get());
    std::this_thread::sleep_for(1ms);
    pool.remove(pieces.get());
    const int done = pieces->done;
    std::this_thread::sleep_for(2ms);
    EXPECT_EQ(pieces->done, done);
  }
}

}  // namespace
}  // namespace lambent
