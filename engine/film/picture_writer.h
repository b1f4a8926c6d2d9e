// Pictures as image files: OpenEXR with all channels, PNG for a quick look.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/base/result.h"
#include "engine/film/rectangle.h"

namespace lambent {

/// A picture to be written; refers to its owner's memory. `pixels` is float[height][width][sum of components], row 0 at
/// the bottom, scene-linear, premultiplied by alpha.
struct PictureView {
  int width = 0, height = 0;
  Rectangle rendered;  ///< what of it was rendered; only this is written (the EXR's data window)
  std::span<const Channel> channels;
  std::span<const float> pixels;
  std::map<std::string, std::string> metadata;
  /// EXR: colours (passes of R, G, B with or without A) in 16 bits, values beyond them as the largest there is; what no
  /// colour is (depth, positions, vectors, ids) stays in 32, as in Blender's files.
  bool half_colors = false;
};

/// Writes `path` under a temporary name, then renames, so that a full disk leaves neither half a file nor a spoilt old
/// one. The extension decides: `.exr` (float, zip; the first pass as R, G, B, A, every other as pass.X) or
/// `.png` (8-bit sRGB of the first pass, straight alpha). Fails with a message that names the file.
Status write_picture(const std::string& path, const PictureView& picture);

/// True for the extensions that write_picture() knows.
bool is_picture_path(const std::string& path);

/// The names of a pass's components in an EXR: `combined` 4 gives R G B A; `normal` 3 with letters XYZ gives normal.X
/// normal.Y normal.Z.
std::vector<std::string> channel_names(const Channel& channel, bool main_picture);

}  // namespace lambent
