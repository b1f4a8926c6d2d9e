// What each technique contributes, as pictures: for debugging light transport (Veach 1997, fig. 10.3).
#pragma once

#include <array>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "engine/base/result.h"
#include "engine/path/contribution.h"

namespace lambent {

/// Sums contributions by path length and technique. Paths of more than k_most_vertices scattering vertices are left to
/// the totals. Thread-safe.
class TechniquePictures final : public ContributionObserver {
 public:
  static constexpr int k_most_vertices = 5;

  TechniquePictures(int width, int height) : width_(width), height_(height) {}

  void on_contribution(const Contribution& contribution) override;

  /// Writes into `folder`, which is made if need be: weighted.png and unweighted.png (a row a path length, a column a
  /// technique), techniques.exr (a layer each, float RGB: "weighted_s1_t3", "merged_3_of_4"), and shares.png (red:
  /// camera walk and next event, green: connections and light tracing, blue: merging; by luminance) with shares.exr.
  /// @param samples of every pixel, that the sums are divided by
  Status write(const std::string& folder, int64_t samples, float exposure) const;

 private:
  /// s light vertices (the light's own point counts), t camera vertices (the lens counts); merging: t = i + 1.
  struct Key {
    int vertices, t;
    bool merging;
    auto operator<=>(const Key&) const = default;
  };
  struct Sums {
    std::vector<float> weighted, unweighted;  ///< float[height][width][3]
  };
  std::string name_of(const Key& key) const;

  const int width_, height_;
  mutable std::mutex mutex_;
  std::map<Key, Sums> pictures_;
  std::array<std::vector<float>, 3> shares_;  ///< luminance by group, float[height][width]
};

}  // namespace lambent
