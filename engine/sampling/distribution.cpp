#include "engine/sampling/distribution.h"

#include <algorithm>
#include <cmath>

namespace lambent {

namespace {

double valid_weight(float weight) { return weight > 0.0f && std::isfinite(weight) ? weight : 0.0; }

/// Fills cdf[0..n] from n weights (fewer may be given: the rest are 0) and returns their mean; uniform if all are 0.
double fill_cdf(std::span<const float> weights, size_t n, float* cdf) {
  double sum = 0.0;
  for (const float weight : weights) sum += valid_weight(weight);
  const bool uniform = !(sum > 0.0);
  double partial = 0.0;
  cdf[0] = 0.0f;
  for (size_t i = 0; i < n; ++i) {
    partial += uniform ? 1.0 : (i < weights.size() ? valid_weight(weights[i]) : 0.0);
    cdf[i + 1] = static_cast<float>(partial / (uniform ? static_cast<double>(n) : sum));
  }
  // Rounding must neither leave a gap below 1 nor give probability to trailing cells of weight 0.
  const float last = cdf[n];
  for (size_t i = n; i > 0 && cdf[i] == last; --i) cdf[i] = 1.0f;
  return uniform ? 0.0 : sum / static_cast<double>(n);
}

/// Cell i with cdf[i] <= u < cdf[i + 1].
int find_cell(const float* cdf, int n, float u) {
  const float* above = std::upper_bound(cdf, cdf + n + 1, u);
  return std::clamp(static_cast<int>(above - cdf) - 1, 0, n - 1);
}

Distribution1D::Sample sample_cdf(const float* cdf, int n, float u) {
  const int cell = find_cell(cdf, n, u);
  const float width = cdf[cell + 1] - cdf[cell];
  Distribution1D::Sample sample;
  sample.cell = cell;
  sample.remapped = width > 0.0f ? std::clamp((u - cdf[cell]) / width, 0.0f, k_one_minus_epsilon) : 0.0f;
  // The position must stay within its cell: at cell + 0.99999994 the sum may round up to the next.
  const float upper = std::nextafter(static_cast<float>(cell + 1) / static_cast<float>(n), 0.0f);
  sample.x = std::min((static_cast<float>(cell) + sample.remapped) / static_cast<float>(n), upper);
  sample.pdf = width * static_cast<float>(n);
  return sample;
}

int cell_of(float x, int n) { return std::min(static_cast<int>(x * static_cast<float>(n)), n - 1); }
bool in_unit(float x) { return x >= 0.0f && x < 1.0f; }

float invert_cdf(const float* cdf, int n, float x) {
  const float position = std::clamp(x, 0.0f, k_one_minus_epsilon) * static_cast<float>(n);
  const int cell = std::min(static_cast<int>(position), n - 1);
  return std::min(lerp(cdf[cell], cdf[cell + 1], position - static_cast<float>(cell)), k_one_minus_epsilon);
}

}  // namespace

Distribution1D::Distribution1D(std::span<const float> weights)
    : cdf_(std::max<size_t>(weights.size(), 1) + 1), integral_(fill_cdf(weights, cdf_.size() - 1, cdf_.data())) {}

Distribution1D::Sample Distribution1D::sample(float u) const { return sample_cdf(cdf_.data(), size(), u); }

float Distribution1D::pdf(float x) const {
  return in_unit(x) ? prob(cell_of(x, size())) * static_cast<float>(size()) : 0.0f;
}

float Distribution1D::invert(float x) const { return invert_cdf(cdf_.data(), size(), x); }

Distribution2D::Distribution2D(std::span<const float> weights, int width, int height) {
  const bool valid =
      width > 0 && height > 0 && weights.size() >= static_cast<size_t>(width) * static_cast<size_t>(height);
  width_ = valid ? width : 1;
  height_ = valid ? height : 1;
  const size_t stride = static_cast<size_t>(width_) + 1;
  rows_.resize(stride * static_cast<size_t>(height_));
  std::vector<double> row_means(static_cast<size_t>(height_), 0.0);
  double largest = 0.0;
  for (int y = 0; y < height_; ++y) {
    const auto row =
        valid ? weights.subspan(static_cast<size_t>(y) * static_cast<size_t>(width_), static_cast<size_t>(width_))
              : std::span<const float>();
    row_means[y] = fill_cdf(row, static_cast<size_t>(width_), rows_.data() + static_cast<size_t>(y) * stride);
    largest = std::max(largest, row_means[y]);
  }
  std::vector<float> marginal(static_cast<size_t>(height_), 0.0f);
  for (int y = 0; y < height_; ++y) marginal[y] = largest > 0.0 ? static_cast<float>(row_means[y] / largest) : 0.0f;
  marginal_ = Distribution1D(marginal);
  for (const double mean : row_means) integral_ += mean / height_;
}

size_t Distribution2D::bytes() const { return (rows_.capacity() + static_cast<size_t>(height_) + 1) * sizeof(float); }

Vec2 Distribution2D::sample(const Vec2& u, float* pdf) const {
  const Distribution1D::Sample v = marginal_.sample(u.y);
  const size_t stride = static_cast<size_t>(width_) + 1;
  const Distribution1D::Sample h = sample_cdf(rows_.data() + static_cast<size_t>(v.cell) * stride, width_, u.x);
  if (pdf) *pdf = v.pdf * h.pdf;
  return {h.x, v.x};
}

float Distribution2D::pdf(const Vec2& uv) const {
  if (!in_unit(uv.x) || !in_unit(uv.y)) return 0.0f;
  const int row = cell_of(uv.y, height_), column = cell_of(uv.x, width_);
  const float* cdf = rows_.data() + static_cast<size_t>(row) * (static_cast<size_t>(width_) + 1);
  return marginal_.pdf(uv.y) * (cdf[column + 1] - cdf[column]) * static_cast<float>(width_);
}

Vec2 Distribution2D::invert(const Vec2& uv) const {
  const int row = cell_of(std::clamp(uv.y, 0.0f, k_one_minus_epsilon), height_);
  const float* cdf = rows_.data() + static_cast<size_t>(row) * (static_cast<size_t>(width_) + 1);
  return {invert_cdf(cdf, width_, uv.x), marginal_.invert(uv.y)};
}

}  // namespace lambent
