#include "scene/files/libheif/heif_picture.h"

#include <fmt/format.h>
#include <libheif/heif.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <new>
#include <string_view>

#include "scene/files/one_line.h"
#include "scene/files/open_to_read.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// A size, "ftyp", the main brand (ISO/IEC 14496-12, section 4.3).
bool MayBeHeif(const fs::path& path) {
  std::array<char, 12> head{};
  if (std::ifstream in = OpenToRead(path); !in.read(head.data(), head.size())) return false;
  const std::string_view text(head.data(), head.size());
  return text.substr(4, 4) == "ftyp" && text.substr(8, 4) != "crx ";
}

void Require(const fs::path& path, const heif_error& error, std::string_view what) {
  if (error.code == heif_error_Ok) return;
  if (error.code == heif_error_Memory_allocation_error && error.subcode != heif_suberror_Security_limit_exceeded)
    throw std::bad_alloc();
  throw InputError(path, fmt::format("{}: {}", what, OneLine(error.message ? error.message : "no reason was given")),
                   "copy it again, or leave it out");
}

struct FreeImage {
  void operator()(heif_image* image) const { heif_image_release(image); }
};
struct FreeNclx {
  void operator()(heif_color_profile_nclx* profile) const { heif_nclx_color_profile_free(profile); }
};

}  // namespace

void HeifPicture::Free::operator()(heif_context* context) const { heif_context_free(context); }
void HeifPicture::Free::operator()(heif_image_handle* handle) const { heif_image_handle_release(handle); }

std::unique_ptr<HeifPicture> HeifPicture::Open(const fs::path& path) {
  if (!MayBeHeif(path)) return nullptr;
  std::unique_ptr<HeifPicture> picture(new HeifPicture);
  picture->path_ = path;
  picture->context_.reset(heif_context_alloc());
  if (!picture->context_) throw std::bad_alloc();
  heif_context* context = picture->context_.get();
  heif_context_set_max_decoding_threads(context, 0);  // callers with many pictures read them in parallel
  constexpr std::string_view kNoPicture = "is not a picture that can be read";
  errno = 0;
  const heif_error error = heif_context_read_from_file(context, path.c_str(), nullptr);
  if (error.code != heif_error_Ok) ThrowIfMachineIsShort(path, errno);
  Require(path, error, kNoPicture);
  heif_image_handle* handle = nullptr;
  Require(path, heif_context_get_primary_image_handle(context, &handle), kNoPicture);
  picture->handle_.reset(handle);
  return picture;
}

int HeifPicture::width() const { return heif_image_handle_get_width(handle_.get()); }
int HeifPicture::height() const { return heif_image_handle_get_height(handle_.get()); }
int HeifPicture::channels() const { return heif_image_handle_has_alpha_channel(handle_.get()) ? 4 : 3; }

std::string HeifPicture::Exif() const {
  heif_item_id id = 0;
  if (heif_image_handle_get_list_of_metadata_block_IDs(handle_.get(), "Exif", &id, 1) < 1) return {};
  std::string block(heif_image_handle_get_metadata_size(handle_.get(), id), '\0');
  if (block.size() < 4 || heif_image_handle_get_metadata(handle_.get(), id, block.data()).code != heif_error_Ok)
    return {};
  // It begins with how many bytes stand before the TIFF header (ISO/IEC 23008-12, A.2.1). Writers do not agree whether
  // "Exif\0\0" counts, and some give the block's length there.
  std::size_t skipped = 0;
  for (std::size_t i = 0; i < 4; ++i) skipped = skipped << 8 | static_cast<unsigned char>(block[i]);
  constexpr std::size_t kMark = 6;
  for (const std::size_t begin : {4 + skipped, 4 + skipped + kMark, 4 + kMark, std::size_t{4}}) {
    // The two letters alone: the number after them is swapped in OpenImageIO 2.4's files.
    const std::string_view header = begin < block.size() ? std::string_view(block).substr(begin, 2) : "";
    if (header == "II" || header == "MM") return block.substr(begin);
  }
  return {};
}

std::string HeifPicture::Profile() const {
  std::string profile(heif_image_handle_get_raw_color_profile_size(handle_.get()), '\0');
  if (profile.empty() || heif_image_handle_get_raw_color_profile(handle_.get(), profile.data()).code != heif_error_Ok)
    return {};
  return profile;
}

bool HeifPicture::IsDisplayP3() const {
  heif_color_profile_nclx* profile = nullptr;
  if (heif_image_handle_get_nclx_color_profile(handle_.get(), &profile).code != heif_error_Ok || !profile) return false;
  const std::unique_ptr<heif_color_profile_nclx, FreeNclx> owner(profile);
  return profile->color_primaries == heif_color_primaries_SMPTE_EG_432_1 &&
         profile->transfer_characteristics == heif_transfer_characteristic_IEC_61966_2_1;
}

Image8 HeifPicture::Pixels(int channels) const {
  heif_image* decoded = nullptr;
  Require(path_,
          heif_decode_image(handle_.get(), &decoded, heif_colorspace_RGB,
                            channels == 4 ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB, nullptr),
          "is truncated or corrupt");
  const std::unique_ptr<heif_image, FreeImage> owner(decoded);
  int stride = 0;
  const std::uint8_t* rows = heif_image_get_plane_readonly(decoded, heif_channel_interleaved, &stride);
  const int wide = heif_image_get_width(decoded, heif_channel_interleaved),
            high = heif_image_get_height(decoded, heif_channel_interleaved);
  if (!rows || wide != width() || high != height() || stride < wide * channels ||
      heif_image_get_bits_per_pixel(decoded, heif_channel_interleaved) != 8 * channels)
    throw InputError(path_,
                     fmt::format("is corrupt: a picture of {} x {} pixels in a container that states {} x {}", wide,
                                 high, width(), height()),
                     "copy it again, or leave it out");
  Image8 image(wide, high, channels);
  for (int y = 0; y < high; ++y)
    std::copy_n(rows + static_cast<std::ptrdiff_t>(y) * stride, static_cast<std::size_t>(wide * channels),
                image.Row(y));
  return image;
}

}  // namespace lumi
