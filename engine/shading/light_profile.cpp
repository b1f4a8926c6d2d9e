#include "engine/shading/light_profile.h"

#include <algorithm>
#include <cstdlib>

#include "engine/shading/color_math.h"

namespace lambent {
namespace {

constexpr size_t k_max_angles = 4096;
constexpr double k_candela = 4.0 * 3.14159265358979 / 177.83;

// A profile with angles in degrees, intensity[horizontal][vertical].
struct Profile {
  std::vector<float> horizontal, vertical;
  std::vector<std::vector<float>> intensity;
};

// The numbers of a file, one after the other.
class Numbers {
 public:
  explicit Numbers(std::string text) : text_(std::move(text)), next_(text_.c_str()) {
    std::replace(text_.begin(), text_.end(), ',', ' ');
    next_ = text_.c_str();
  }
  double take() {
    char* end = nullptr;
    const double x = std::strtod(next_, &end);
    good_ &= end != next_ && std::isfinite(x);
    next_ = end;
    return x;
  }
  std::vector<float> take(size_t count) {
    std::vector<float> values;
    for (size_t i = 0; i < count && good_; ++i) values.push_back(static_cast<float>(take()));
    return values;
  }
  bool good() const { return good_; }

 private:
  std::string text_;
  const char* next_;
  bool good_ = true;
};

// Goes on behind the last angle, mirrored at it.
void mirror(std::vector<float>& angles, std::vector<std::vector<float>>& rows) {
  const float last = angles.back();
  for (size_t i = angles.size() - 1; i-- > 0;) {
    angles.push_back(2.0f * last - angles[i]);
    rows.push_back(rows[i]);
  }
}

std::vector<std::vector<float>> transposed(const std::vector<std::vector<float>>& rows) {
  std::vector<std::vector<float>> columns(rows.front().size(), std::vector<float>(rows.size()));
  for (size_t i = 0; i < rows.size(); ++i)
    for (size_t j = 0; j < rows[i].size(); ++j) columns[j][i] = rows[i][j];
  return columns;
}

// From [0, 90] or [-90, 90] to [0, 180]: the first is what lies on both sides of the middle.
bool full_half_circle(std::vector<float>& angles, std::vector<std::vector<float>>& rows) {
  if (angles.back() != 90.0f) return false;
  if (angles.front() == 0.0f) {
    std::reverse(angles.begin(), angles.end());
    std::reverse(rows.begin(), rows.end());
    for (float& angle : angles) angle = 90.0f - angle;
    mirror(angles, rows);
    return true;
  }
  for (float& angle : angles) angle += 90.0f;
  return angles.front() == 0.0f;
}

bool arrange_type_b(Profile& p) {
  // Its planes are vertical where type C's are horizontal.
  p.intensity = transposed(p.intensity);
  std::swap(p.horizontal, p.vertical);
  if (!full_half_circle(p.horizontal, p.intensity)) return false;
  p.horizontal.push_back(360.0f);
  p.intensity.push_back(p.intensity.front());
  auto columns = transposed(p.intensity);
  if (!full_half_circle(p.vertical, columns)) return false;
  p.intensity = transposed(columns);
  return true;
}

bool arrange_type_c(Profile& p) {
  if (p.horizontal.front() == 90.0f)
    for (float& angle : p.horizontal) angle -= 90.0f;
  if (p.horizontal.front() != 0.0f) return false;
  if (p.horizontal.size() == 1) {
    p.horizontal.push_back(360.0f);
    p.intensity.push_back(p.intensity.front());
  }
  if (p.horizontal.back() == 90.0f) mirror(p.horizontal, p.intensity);
  if (p.horizontal.back() == 180.0f) mirror(p.horizontal, p.intensity);
  if (p.horizontal.back() != 360.0f) {
    // Some files leave out the last plane, which is the first.
    const size_t n = p.horizontal.size();
    const float rest = 360.0f - p.horizontal.back();
    if (p.horizontal[n - 1] - p.horizontal[n - 2] != rest && p.horizontal[1] - p.horizontal[0] != rest) return false;
    p.horizontal.push_back(360.0f);
    p.intensity.push_back(p.intensity.front());
  }
  if (p.vertical.front() == 90.0f && p.vertical.back() == 180.0f) {
    for (float& angle : p.vertical) angle = 180.0f - angle;
    std::reverse(p.vertical.begin(), p.vertical.end());
    for (auto& row : p.intensity) std::reverse(row.begin(), row.end());
  }
  return p.vertical.front() == 0.0f;
}

// Catmull and Rom's spline through b (t = 0) and c (t = 1).
float cubic(float a, float b, float c, float d, float t) {
  return 0.5f * (((d + 3.0f * (b - c) - a) * t + (2.0f * a - 5.0f * b + 4.0f * c - d)) * t + (c - a)) * t + b;
}

// Interval of ascending angles that holds `angle`, and where in it.
int interval(const float* angles, int count, float angle, float& fraction) {
  const int i =
      std::clamp(static_cast<int>(std::lower_bound(angles, angles + count, angle) - angles) - 1, 0, count - 2);
  const float width = angles[i + 1] - angles[i];
  fraction = width > 0.0f ? saturate((angle - angles[i]) / width) : 0.0f;
  return i;
}

}  // namespace

Result<std::vector<float>> read_light_profile(const std::string& text) {
  const size_t tilt = text.find("TILT=");
  if (tilt == std::string::npos) return Error{"it is not an IES file: it has no line TILT="};
  const bool included = text.compare(tilt + 5, 7, "INCLUDE") == 0;
  const size_t line_end = text.find('\n', tilt);
  if (line_end == std::string::npos) return Error{"it ends after its line TILT="};
  Numbers numbers(text.substr(line_end));
  if (included) {
    numbers.take();
    const double count = numbers.take();
    if (count < 0 || count > k_max_angles) return Error{"its number of tilt angles is not possible"};
    numbers.take(static_cast<size_t>(2 * count));
  }
  numbers.take(2);  // lamps, lumens a lamp
  double factor = numbers.take() * k_candela;
  const double vertical = numbers.take(), horizontal = numbers.take(), type = numbers.take();
  numbers.take(4);  // unit, width, length, height
  factor *= numbers.take();
  factor *= numbers.take();
  numbers.take();  // watts
  if (!numbers.good()) return Error{"its header is not complete"};
  if (!(vertical >= 1 && vertical <= k_max_angles && horizontal >= 1 && horizontal <= k_max_angles))
    return Error{"its number of angles is not possible"};
  if (type != 1.0 && type != 2.0) return Error{"its photometric type is neither B nor C"};
  Profile profile;
  profile.vertical = numbers.take(static_cast<size_t>(vertical));
  profile.horizontal = numbers.take(static_cast<size_t>(horizontal));
  for (size_t i = 0; i < static_cast<size_t>(horizontal) && numbers.good(); ++i) {
    profile.intensity.push_back(numbers.take(static_cast<size_t>(vertical)));
    for (float& x : profile.intensity.back()) x = static_cast<float>(x * factor);
  }
  if (!numbers.good()) return Error{"it has fewer intensities than it says"};
  const auto ascending = [](const std::vector<float>& angles) { return std::is_sorted(angles.begin(), angles.end()); };
  if (!ascending(profile.vertical) || !ascending(profile.horizontal)) return Error{"its angles do not ascend"};
  if (!(type == 1.0 ? arrange_type_c(profile) : arrange_type_b(profile)) || profile.vertical.size() < 2)
    return Error{"its angles are not a range that IES files may have"};

  std::vector<float> table{static_cast<float>(profile.horizontal.size()), static_cast<float>(profile.vertical.size())};
  for (const float angle : profile.horizontal) table.push_back(angle * k_pi / 180.0f);
  for (const float angle : profile.vertical) table.push_back(angle * k_pi / 180.0f);
  for (const auto& row : profile.intensity) table.insert(table.end(), row.begin(), row.end());
  return table;
}

float light_profile(const std::vector<float>& table, const Vec3& d) {
  const float l = length(d);
  if (table.size() < 2 || !(l > 0.0f) || !std::isfinite(l)) return 0.0f;
  const int columns = static_cast<int>(table[0]), rows = static_cast<int>(table[1]);
  const float* horizontal = table.data() + 2;
  const float* vertical = horizontal + columns;
  const float* intensity = vertical + rows;
  const float v_angle = std::acos(std::clamp(-d.z / l, -1.0f, 1.0f)), h_angle = std::atan2(d.x, d.y) + k_pi;
  if (v_angle >= vertical[rows - 1]) return 0.0f;
  float h = 0.0f, v = 0.0f;
  const int column = interval(horizontal, columns, h_angle, h), row = interval(vertical, rows, v_angle, v);
  const auto along = [&](int i) {
    const float* values = intensity + i * rows;
    // Beyond the pole lies what mirrors this side.
    return cubic(values[row == 0 ? 1 : row - 1], values[row], values[row + 1], values[std::min(row + 2, rows - 1)], v);
  };
  // The last column is the first.
  return std::max(cubic(along(column == 0 ? columns - 2 : column - 1), along(column), along(column + 1),
                        along(column + 2 == columns ? 1 : column + 2), h),
                  0.0f);
}

}  // namespace lambent
