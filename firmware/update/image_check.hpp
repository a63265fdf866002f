// Whether an image is genuine and whole: its header by the key of this program, its payload by what the header says of it.
#pragma once
#include <algorithm>
#include <span>

#include "firmware/update/image.hpp"
#include "firmware/update/update_key.hpp"
#include "protocols/crc.hpp"

namespace rotorloop::firmware {

// `head`: the first kImageHeadBytes of the image, of which parse_image() thinks well.
inline ImageFault signature_fault(std::span<const std::uint8_t> head, const UpdateKey& key) {
  if (key.kind == KeyKind::none) return ImageFault::none;
  if (!has_signature(head)) return ImageFault::not_signed;
  return signature_good(head, key.key) ? ImageFault::none : ImageFault::wrong_key;
}

// Takes the payload in pieces.
class PayloadCheck {
 public:
  void add(std::span<const std::uint8_t> payload) {
    crc_.add(payload);
    digest_.add(payload);
  }
  // Once, after all of the payload. An image that is not signed may come without the SHA-512 of its payload.
  bool fits(std::span<const std::uint8_t> head, const ImageHeader& h) {
    if (crc_.value() != h.crc) return false;
    const auto digest = digest_.value();
    return !has_signature(head) || std::equal(digest.begin(), digest.end(), head.begin() + kDigestAt);
  }

 private:
  protocols::Crc64 crc_;
  PayloadDigest digest_;
};

}  // namespace rotorloop::firmware
