#include "cli/image/image_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>

#include "firmware/update/image_check.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"

namespace rotorloop::cli {
namespace {

constexpr std::uintmax_t kLargestImage_B = 16u << 20;  // far beyond any ESC: a disk image given by mistake

std::span<const std::uint8_t> payload_of(const std::vector<std::uint8_t>& image) {
  return std::span(image).subspan(std::min<std::size_t>(firmware::kImageHeaderBytes, image.size()));
}

}  // namespace

std::vector<std::uint8_t> read_image_bytes(const std::filesystem::path& path) {
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  std::ifstream file(path, std::ios::binary);
  if (none || !file) throw Error({path.generic_string(), "cannot read the file", "", "check the path"});
  if (size == 0 || size > kLargestImage_B)
    throw Error({path.generic_string(), fmt::format("{} bytes are no program: 1 to {} are possible", size, kLargestImage_B), "",
                 "give the file that the build made for the node"});
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void write_image_bytes(const std::filesystem::path& path, const std::vector<std::uint8_t>& image) {
  write_text_file(path, {reinterpret_cast<const char*>(image.data()), image.size()});
}

std::vector<std::uint8_t> made_image(firmware::ImageHeader header, const std::vector<std::uint8_t>& payload) {
  protocols::Crc64 crc;
  crc.add(payload);
  header.size = static_cast<std::uint32_t>(payload.size());
  header.crc = crc.value();
  std::vector<std::uint8_t> image(firmware::kImageHeaderBytes, 0xFF);
  firmware::write_image_fields(header, image);
  image.insert(image.end(), payload.begin(), payload.end());
  return image;
}

void sign_image(std::vector<std::uint8_t>& image, const SigningKey& key) {
  firmware::PayloadDigest digest;
  digest.add(payload_of(image));
  const auto value = digest.value();
  std::copy(value.begin(), value.end(), image.begin() + firmware::kDigestAt);
  const auto signature = key.sign(firmware::signed_bytes(image));
  std::copy(signature.begin(), signature.end(), image.begin() + firmware::kSignatureAt);
}

std::string ExaminedImage::board() const { return {header.board.data(), ::strnlen(header.board.data(), header.board.size())}; }

ExaminedImage examined(const std::vector<std::uint8_t>& image) {
  ExaminedImage e;
  e.fault = firmware::parse_image(image, e.header);
  if (e.fault != firmware::ImageFault::none) return e;
  const auto payload = payload_of(image);
  e.payload_bytes = payload.size();
  if (image.size() < firmware::kImageHeaderBytes || payload.size() < e.header.size) {
    e.fault = firmware::ImageFault::truncated;
    return e;
  }
  e.is_signed = firmware::has_signature(image);
  firmware::PayloadCheck check;
  check.add(payload.first(e.header.size));
  if (!check.fits(image, e.header)) e.fault = firmware::ImageFault::damaged;
  return e;
}

void must_be_whole(const std::filesystem::path& path, const ExaminedImage& image) {
  using enum firmware::ImageFault;
  if (image.fault == none) return;
  std::string what = firmware::image_fault_text(image.fault);
  if (image.fault == truncated) what += fmt::format(" ({} of {} payload bytes)", image.payload_bytes, image.header.size);
  const bool foreign = image.fault == not_an_image || image.fault == header_version;
  throw Error({path.generic_string(), what, foreign ? "a file of another maker, or an ELF" : "the file was changed or cut on its way",
               foreign ? "give an .rlf file; `rotorloop image create` makes one of a payload" : "make or download it again"},
              ExitCode::data_quality);
}

}  // namespace rotorloop::cli
