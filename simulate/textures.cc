#include "simulate/textures.h"

#include <algorithm>
#include <cmath>

#include "scene/files/image_io.h"
#include "simulate/glyphs.h"
#include "simulate/noise.h"
#include "simulate/photo_response.h"

namespace lumi {
namespace {

std::uint32_t Bits(float integer) { return static_cast<std::uint32_t>(static_cast<std::int32_t>(integer)); }
float UnitF(std::uint32_t bits) { return static_cast<float>(bits >> 8) * (1.0f / 16777216.0f); }

// Share of an interval of width `footprint` about x that lies above 0: an edge without stairs.
float Above(float x, float footprint) { return std::clamp(x / std::max(footprint, 1e-6f) + 0.5f, 0.0f, 1.0f); }

Rgb Mix(const Rgb& a, const Rgb& b, float t) { return a + t * (b - a); }

}  // namespace

Texture::Texture(const TextureDescription& description) : d_(description) {
  if (d_.kind != TextureKind::kImage) return;
  std::vector<Level> levels;
  const auto append = [&](const Image8& picture) {
    Level level{picture.width, picture.height, {}};
    level.pixels.reserve(static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height));
    for (std::size_t i = 0; i + 2 < picture.data.size(); i += 3)
      level.pixels.emplace_back(static_cast<float>(LightFromCode(picture.data[i] / 255.0)),
                                static_cast<float>(LightFromCode(picture.data[i + 1] / 255.0)),
                                static_cast<float>(LightFromCode(picture.data[i + 2] / 255.0)));
    levels.push_back(std::move(level));
  };
  for (const Image8& picture : BuildPyramid(ReadImage8(d_.file))) append(picture);
  pyramid_ = std::make_shared<const std::vector<Level>>(std::move(levels));
}

Rgb Texture::At(const SurfacePlace& place) const {
  Rgb color;
  switch (d_.kind) {
    case TextureKind::kConstant: color = d_.colors[0]; break;
    case TextureKind::kNoise: color = Noise(place); break;
    case TextureKind::kCells: color = Cells(place); break;
    case TextureKind::kBricks: color = Bricks(place, true); break;
    case TextureKind::kTiles: color = Bricks(place, false); break;
    case TextureKind::kStripes: color = Stripes(place); break;
    case TextureKind::kWood: color = Wood(place); break;
    case TextureKind::kGlyphs: color = Glyphs(place); break;
    case TextureKind::kImage: color = Picture(place); break;
    case TextureKind::kChecker: color = Checker(place); break;
  }
  if (d_.grain > 0) {
    const auto size = static_cast<float>(d_.grain_size);
    const float n = FractalNoise(place.x_in_object / size, 3, 0.6f, place.footprint / size, d_.seed + 77);
    color *= std::max(0.0f, 1.0f + static_cast<float>(d_.grain) * n);
  }
  return color;
}

Rgb Texture::Palette(float t) const {
  const auto last = static_cast<float>(d_.colors.size() - 1);
  if (last == 0) return d_.colors[0] * (0.6f + 0.8f * std::clamp(t, 0.0f, 1.0f));
  const float at = std::clamp(t, 0.0f, 1.0f) * last;
  const float i = std::min(std::floor(at), last - 1);
  return Mix(d_.colors[static_cast<std::size_t>(i)], d_.colors[static_cast<std::size_t>(i) + 1], at - i);
}

Rgb Texture::Pick(std::uint32_t bits) const {
  const Rgb color = d_.colors[bits % d_.colors.size()];
  return color * std::max(0.0f, 1.0f + static_cast<float>(d_.variation) * (2 * UnitF(HashBits(bits, 5)) - 1));
}

Rgb Texture::Noise(const SurfacePlace& place) const {
  const auto size = static_cast<float>(d_.size.x());
  const float noise =
      FractalNoise(place.x_in_object / size, d_.octaves, static_cast<float>(d_.gain), place.footprint / size, d_.seed);
  const float t = 0.5f + 0.6f * static_cast<float>(d_.contrast) * noise;
  if (d_.bands <= 1) return Palette(t);
  // Flat colours between sharp contours.
  const auto bands = static_cast<float>(d_.bands);
  const float band = std::clamp(std::floor(t * bands), 0.0f, bands - 1);
  return Palette(band / (bands - 1));
}

Rgb Texture::Cells(const SurfacePlace& place) const {
  // Nearest and second nearest of jittered points, one a grid cell (Worley 1996).
  const Eigen::Vector2f x = place.uv.cwiseQuotient(d_.size.cast<float>());
  const Eigen::Vector2f base(std::floor(x.x()), std::floor(x.y()));
  float first = 1e9f, second = 1e9f;
  std::uint32_t owner = 0;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      const Eigen::Vector2f cell = base + Eigen::Vector2f(static_cast<float>(i), static_cast<float>(j));
      const std::uint32_t bits = HashBits(Bits(cell.x()), Bits(cell.y()), d_.seed);
      const Eigen::Vector2f point =
          cell + Eigen::Vector2f(0.1f + 0.8f * UnitF(bits), 0.1f + 0.8f * UnitF(HashBits(bits)));
      const float distance = (x - point).norm();
      if (distance < first) {
        second = first;
        first = distance;
        owner = bits;
      } else {
        second = std::min(second, distance);
      }
    }
  const float footprint = place.footprint / static_cast<float>(d_.size.minCoeff());
  const float inside = d_.joint > 0 ? Above(second - first - static_cast<float>(d_.joint), 2 * footprint) : 1.0f;
  return Mix(d_.joint_color, Pick(HashBits(owner, 3)), inside);
}

Rgb Texture::Bricks(const SurfacePlace& place, bool shifted_rows) const {
  Eigen::Vector2f x = place.uv.cwiseQuotient(d_.size.cast<float>());
  const float row = std::floor(x.y());
  if (shifted_rows && (Bits(row) & 1U) != 0) x.x() += 0.5f;
  const float column = std::floor(x.x());
  const Rgb brick = Pick(HashBits(Bits(column), Bits(row), d_.seed));
  if (d_.joint <= 0) return brick;
  // The joint is as wide across as along: a share of the smaller side.
  const auto smaller = static_cast<float>(d_.size.minCoeff());
  const Eigen::Vector2f inside = x - Eigen::Vector2f(column, row);
  const Eigen::Vector2f to_edge = inside.cwiseMin(Eigen::Vector2f::Ones() - inside).cwiseProduct(d_.size.cast<float>());
  const float half_joint = 0.5f * static_cast<float>(d_.joint) * smaller;
  const float share =
      Above(to_edge.x() - half_joint, place.footprint) * Above(to_edge.y() - half_joint, place.footprint);
  return Mix(d_.joint_color, brick, share);
}

Rgb Texture::Stripes(const SurfacePlace& place) const {
  const float x = place.uv.x() / static_cast<float>(d_.size.x());
  const float stripe = std::floor(x);
  const auto color = [&](float i) {
    const std::uint32_t n = static_cast<std::uint32_t>(d_.colors.size());
    const auto at = static_cast<std::int32_t>(i) % static_cast<std::int32_t>(n);
    return d_.colors[static_cast<std::size_t>(at < 0 ? at + static_cast<std::int32_t>(n) : at)];
  };
  const float footprint = place.footprint / static_cast<float>(d_.size.x());
  const float inside = x - stripe;
  if (inside < 0.5f * footprint) return Mix(color(stripe - 1), color(stripe), Above(inside, footprint));
  return Mix(color(stripe), color(stripe + 1), Above(inside - 1, footprint));
}

Rgb Texture::Wood(const SurfacePlace& place) const {
  // Boards along u, `size` each; grain is noise stretched along the board, different in every board.
  const Eigen::Vector2f x = place.uv.cwiseQuotient(d_.size.cast<float>());
  const float row = std::floor(x.y());
  const std::uint32_t row_bits = HashBits(Bits(row), d_.seed);
  const float shifted = x.x() + UnitF(row_bits);
  const float column = std::floor(shifted);
  const std::uint32_t board = HashBits(Bits(column), Bits(row), d_.seed + 1);
  const auto width = static_cast<float>(d_.size.y());
  const Eigen::Vector3f grain_place(place.uv.x() / (3.0f * width), place.uv.y() / (0.22f * width),
                                    13.0f * UnitF(board));
  const float footprint = place.footprint / (0.22f * width);
  const float rings = FractalNoise(grain_place, 5, 0.65f, footprint, board & 0xffffU);
  Rgb color = Palette(0.5f + 0.55f * rings);
  color *= 1.0f + static_cast<float>(d_.variation) * (2 * UnitF(HashBits(board, 9)) - 1);
  if (d_.joint > 0) {
    const Eigen::Vector2f inside(shifted - column, x.y() - row);
    const Eigen::Vector2f to_edge =
        inside.cwiseMin(Eigen::Vector2f::Ones() - inside).cwiseProduct(d_.size.cast<float>());
    const float half_joint = 0.5f * static_cast<float>(d_.joint) * width;
    const float share = Above(to_edge.minCoeff() - half_joint, place.footprint);
    color = Mix(d_.joint_color, color, share);
  }
  return color;
}

Rgb Texture::Glyphs(const SurfacePlace& place) const {
  // Lines of words of random letters. size: of one letter with its gap; colors: paper, then inks (one a line).
  constexpr float kColumns = kGlyphColumns + 1, kRows = kGlyphRows + 3;
  const Rgb& paper = d_.colors[0];
  const Eigen::Vector2f x = place.uv.cwiseQuotient(d_.size.cast<float>());
  const float line = std::floor(x.y());
  const float letter = std::floor(x.x());
  const std::uint32_t line_bits = HashBits(Bits(line), d_.seed);
  const std::uint32_t bits = HashBits(Bits(letter), line_bits);
  if (bits % 6 == 0) return paper;  // between words
  const auto& glyph = kGlyphs[HashBits(bits, 1) % kGlyphs.size()];
  const float dot_x = (x.x() - letter) * kColumns;
  const float dot_y = (1 - (x.y() - line)) * kRows - 1;  // v points up, rows count down
  const auto dot_is_ink = [&](float i, float j) {
    if (i < 0 || i >= kGlyphColumns || j < 0 || j >= kGlyphRows) return false;
    return ((glyph[static_cast<std::size_t>(j)] >> (kGlyphColumns - 1 - static_cast<int>(i))) & 1) != 0;
  };
  const Rgb& ink = d_.colors.size() > 1 ? d_.colors[1 + line_bits % (d_.colors.size() - 1)] : d_.joint_color;
  // Letters smaller than the footprint are grey, not noise.
  const float dot = static_cast<float>(d_.size.x()) / kColumns;
  const float blurred = std::clamp(place.footprint / dot - 1, 0.0f, 1.0f);
  const float sharp = dot_is_ink(std::floor(dot_x), std::floor(dot_y)) ? 1.0f : 0.0f;
  constexpr float kMeanInk = 0.25f;  // share of a letter's cell that is ink
  return Mix(paper, ink, sharp + blurred * (kMeanInk - sharp));
}

Rgb Texture::Checker(const SurfacePlace& place) const {
  // A product of two square waves of +-1, each averaged over the footprint exactly: edges move smoothly however few
  // samples there are.
  const auto wave = [&](float x, float side) {
    const float at = x / side, width = place.footprint / side, edge = std::round(at);
    if (width <= 1) {  // the nearest edge alone is within it
      const float beyond = std::clamp(2 * (at - edge) / std::max(width, 1e-6f), -1.0f, 1.0f);
      return (Bits(edge) & 1U) == 0 ? beyond : -beyond;
    }
    const auto integral = [](float t) { return 1 - std::abs(t - 2 * std::floor(0.5f * t) - 1); };
    return (integral(at + 0.5f * width) - integral(at - 0.5f * width)) / width;
  };
  const float sign =
      wave(place.uv.x(), static_cast<float>(d_.size.x())) * wave(place.uv.y(), static_cast<float>(d_.size.y()));
  return Mix(d_.colors[0], d_.colors.size() > 1 ? d_.colors[1] : d_.joint_color, 0.5f - 0.5f * sign);
}

Rgb Texture::Picture(const SurfacePlace& place) const {
  const Eigen::Vector2f x = place.uv.cwiseQuotient(d_.size.cast<float>());
  const std::vector<Level>& pyramid = *pyramid_;
  const float pixels = place.footprint / static_cast<float>(d_.size.x()) * static_cast<float>(pyramid[0].width);
  const auto at_level = [&](std::size_t index) {
    const Level& level = pyramid[index];
    const auto wrap = [](float value, int n) {
      const int i = static_cast<int>(std::floor(value)) % n;
      return i < 0 ? i + n : i;
    };
    const float u = x.x() * static_cast<float>(level.width) - 0.5f;
    const float v = (1 - x.y()) * static_cast<float>(level.height) - 0.5f;
    const float fu = u - std::floor(u), fv = v - std::floor(v);
    const auto pixel = [&](float du, float dv) -> const Rgb& {
      return level.pixels[static_cast<std::size_t>(wrap(v + dv, level.height)) * static_cast<std::size_t>(level.width) +
                          static_cast<std::size_t>(wrap(u + du, level.width))];
    };
    return Mix(Mix(pixel(0, 0), pixel(1, 0), fu), Mix(pixel(0, 1), pixel(1, 1), fu), fv);
  };
  const float level = std::clamp(std::log2(std::max(pixels, 1.0f)), 0.0f, static_cast<float>(pyramid.size() - 1));
  const auto lower = static_cast<std::size_t>(level);
  const std::size_t upper = std::min(lower + 1, pyramid.size() - 1);
  return Mix(at_level(lower), at_level(upper), level - static_cast<float>(lower));
}

}  // namespace lumi
