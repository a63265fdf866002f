// Fetches an image over the bus and puts it into the application area. Runs after a reset, in place of the application: either the
// application left a job (UpdateRecord), or there is no application that could be started and the node waits for BeginFirmwareUpdate.
//   loop: while (frame) updater.on_frame(frame, now); updater.poll(now); while (mailbox free) send(updater.next_frame());
//         when updater.finished(): reset or jump; start what ApplicationArea::installed() says.
// Order: file.GetInfo, the first block with the header, its check, and only then erase and program, block by block. A request that stays
// unanswered is repeated after 1 s until anything was answered, then after four times the slowest answer, 30 ms to 1 s, doubled after every
// sixteenth repetition in a row. 30 s without a good block end the job: the old image runs on, or, if its place was already erased, the
// node waits on the bus and asks again. Then, and after 5 s of silence already, another BeginFirmwareUpdate takes the place of the job. No
// page is erased while an answer is due. The header alone says whether an image is signed with the right key: what is not is refused before
// anything is erased. Before the first word is released, signature and payload are checked again as they lie in flash. The least security
// version is that of the image that could be started, of the record, or of the mark in an area without an image: one of the three is whole
// at any time (decision 0192).
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/core/node/allocation_client.hpp"
#include "firmware/core/node/division.hpp"
#include "firmware/core/node/text_line.hpp"
#include "firmware/update/application_area.hpp"
#include "firmware/update/image.hpp"
#include "firmware/update/image_check.hpp"
#include "firmware/update/update_path.hpp"
#include "firmware/update/update_record.hpp"
#include "firmware/update/update_voice.hpp"
#include "firmware/update/updater_config.hpp"
#include "protocols/receiver.hpp"
#include "protocols/types.hpp"

namespace rotorloop::firmware {

template <UpdateFlash Flash>
class Updater {
 public:
  static constexpr std::uint64_t kGiveUp_us = 30'000'000, kFirstTimeout_us = 1'000'000, kLeastTimeout_us = 30'000;
  static constexpr std::uint64_t kTakeOver_us = 5'000'000;  // without a good block: another job may take the place of this one
  static constexpr std::uint32_t kDamagedTries = 2;         // files that come whole and are damaged, before the job ends

  Updater(Flash& flash, const UpdaterConfig& config)
      : config_(config),
        record_(flash, config.layout.record_page),
        area_(flash, config.layout),
        old_(area_.installed(config.board, config.key)),
        job_(record_.job()),
        least_security_(std::max({old_ ? old_->security_version : 0, record_.security_version(), area_.left_security_version()})),
        voice_(job_ ? job_->own_id : config.own_id),
        receiver_(voice_.own_id(), kSubscriptions),
        allocation_(config.unique_id, 0) {}

  void on_frame(const CanFrame& frame, std::uint64_t now_us) {
    const auto t = receiver_.accept(frame, now_us);
    if (!t) return;
    if (t->id.kind == Kind::request) return on_request(*t, now_us);
    if (t->id.kind == Kind::message) return on_allocation(*t, now_us);
    if (!waiting_ || t->id.source != job_->server || t->transfer_id != asked_transfer_ || t->id.data_type_id != asked_type_) {
      ++counters_.stray;
      return;
    }
    waiting_ = false;
    repeated_ = 0;
    slowest_us_ = std::max(slowest_us_, now_us - asked_us_);
    t->id.data_type_id == protocols::FileGetInfo::kType.id ? on_info(*t, now_us) : on_block(*t, now_us);
  }

  void poll(std::uint64_t now_us) {
    if (!started_) {
      started_ = true;
      start_us_ = good_us_ = next_status_us_ = now_us;
    }
    voice_.queue().expire(now_us);
    if (voice_.own_id() == 0) {
      if (const auto question = allocation_.poll(now_us)) voice_.queue().push(*question, now_us);
      return;
    }
    send_status(now_us);
    if (!job_ || end_ != UpdateEnd::none || !record_is_written()) return;
    if (now_us - good_us_ > kGiveUp_us) return give_up("no answer from the file server", now_us);
    if (waiting_ && now_us - asked_us_ < timeout_us()) return;
    if (waiting_) {
      ++counters_.repeated;
      ++repeated_;
    }
    ask(now_us);
  }

  std::optional<CanFrame> next_frame() { return voice_.queue().pop(); }

  // What was said last has left, or half a second has passed: reset now.
  bool finished(std::uint64_t now_us) const {
    return end_ != UpdateEnd::none && may_start() && (voice_.queue().size() == 0 || now_us - end_us_ > 500'000);
  }
  UpdateEnd end() const { return end_; }
  ImageFault image_fault() const { return fault_; }
  bool has_job() const { return job_.has_value(); }
  const std::optional<ImageHeader>& application() const { return old_; }  // that was whole at the start
  bool may_start() const { return end_ == UpdateEnd::installed || (old_ && !erased_); }
  std::uint8_t own_id() const { return voice_.own_id(); }  // 0: not yet allocated
  // What a node without a job says of itself in its NodeStatus.
  void set_waiting(std::uint16_t vendor_status, protocols::Health health) {
    waiting_status_ = vendor_status;
    waiting_health_ = health;
  }
  void say(protocols::LogMessage::Level level, const char* text, std::uint64_t now_us) { voice_.say(level, text, now_us); }
  const UpdateCounters& counters() const { return counters_; }
  std::uint32_t offset() const { return offset_; }  // bytes of the image in place

  std::uint64_t timeout_us() const {
    if (slowest_us_ == 0) return kFirstTimeout_us;
    return std::min(std::clamp(4 * slowest_us_, kLeastTimeout_us, kFirstTimeout_us) << std::min(repeated_ / 16, 5u), kFirstTimeout_us);
  }

 private:
  using Kind = protocols::TransferKind;
  static constexpr std::uint32_t kBlock = protocols::FileRead::kBlock;
  static_assert(kImageHeaderBytes % kBlock == 0 && kBlock >= kImageHeadBytes);
  static_assert(Flash::kFlashPageBytes % kBlock == 0);
  static constexpr std::array kSubscriptions{protocols::subscribe(Kind::message, protocols::Allocation::kType),
                                             protocols::subscribe(Kind::response, protocols::FileRead::kType),
                                             protocols::subscribe(Kind::response, protocols::FileGetInfo::kType),
                                             protocols::subscribe(Kind::request, protocols::GetNodeInfo::kType),
                                             protocols::subscribe(Kind::request, protocols::BeginFirmwareUpdate::kType)};

  // The answer to BeginFirmwareUpdate leaves first: the record's page takes 22 ms to erase.
  bool record_is_written() {
    if (!record_due_) return true;
    if (voice_.queue().size() != 0) return false;
    record_due_ = false;
    if (!renew_record()) ++counters_.flash_errors;
    return true;
  }

  void ask(std::uint64_t now_us) {
    waiting_ = true;
    asked_us_ = now_us;
    if (!info_known_) {
      protocols::FileGetInfo q;
      q.path.path = job_->path;
      return request(q, info_id_, now_us);
    }
    protocols::FileRead q{.offset = offset_, .path = {}};
    q.path.path = job_->path;
    request(q, read_id_, now_us);
  }
  template <class T>
  void request(const T& q, protocols::TransferIdCounter& id, std::uint64_t now_us) {
    asked_type_ = T::kType.id;
    asked_transfer_ = id.next();
    voice_.request(job_->server, asked_transfer_, q, now_us);
  }

  void on_info(const protocols::Transfer& t, std::uint64_t now_us) {
    protocols::FileGetInfoResponse r;
    if (!decode(t.payload, r)) return;
    if (r.error.value != protocols::FileError::kOk && r.error.value != protocols::FileError::kNotImplemented) {
      return give_up("the file server does not have the file", now_us);
    }
    good_us_ = now_us;
    info_known_ = true;
    file_bytes_ = r.error.value == protocols::FileError::kOk ? r.size : 0;
  }

  void on_block(const protocols::Transfer& t, std::uint64_t now_us) {
    protocols::FileReadResponse r;
    if (!decode(t.payload, r)) return;
    if (r.error.value != protocols::FileError::kOk) return give_up("the file server cannot read the file", now_us);
    good_us_ = now_us;
    ++counters_.blocks;
    if (!header_ && !accept_header(r.data.view(), now_us)) return;
    // The next block is asked for by the next poll: after the flash, whose time is no time of the server.
    store(r.data.view(), now_us);
  }

  // Nothing was erased before this. False when the job has ended, or goes on elsewhere in the image.
  bool accept_header(std::span<const std::uint8_t> block, std::uint64_t now_us) {
    ImageHeader h;
    fault_ = header_fault(block, h);
    if (fault_ != ImageFault::none) {
      TextLine why(image_fault_text(fault_));
      if (fault_ == ImageFault::older_security_version)
        why = TextLine("image has security version ")
                  .add_decimal(h.security_version)
                  .add(", this node wants ")
                  .add_decimal(least_security_)
                  .add(" or more");
      refuse(why, now_us);
      return false;
    }
    header_ = h;
    std::copy_n(block.begin(), first_word_.size(), first_word_.begin());
    if (old_ && *old_ == h) {  // a cut came between the last word and the end of the job
      finish(UpdateEnd::installed, "image is installed already", now_us);
      return false;
    }
    say_key(now_us);
    const auto before = record_.image();
    if (before == h.crc && !old_) return resume(now_us);
    // Another image was being written, and its marks are of no use, or an installed image has raised the least security version.
    if ((before || least_security_ > record_.security_version()) && !renew_record()) return flash_failed(now_us);
    if (!record_.set_image(h.crc)) return flash_failed(now_us);
    return begin_page(0, now_us);
  }
  ImageFault header_fault(std::span<const std::uint8_t> block, ImageHeader& h) const {
    if (const ImageFault f = parse_image(block, h); f != ImageFault::none) return f;
    if (block.size() < kImageHeadBytes) return ImageFault::truncated;
    if (const ImageFault f = check_image(h, config_.board, area_.bytes(), least_security_); f != ImageFault::none) return f;
    if (file_bytes_ != 0 && file_bytes_ < kImageHeaderBytes + h.size) return ImageFault::truncated;
    return signature_fault(block, config_.key);
  }

  void say_key(std::uint64_t now_us) {
    if (const char* text = key_warning(config_.key.kind); *text != '\0') voice_.say(protocols::LogMessage::Level::warning, text, now_us);
  }

  // Goes on at the first page that is not in place. An area that is complete is only released.
  bool resume(std::uint64_t now_us) {
    erased_ = true;
    std::uint32_t page = 0;
    while (page * Flash::kFlashPageBytes < image_bytes() && record_.page_done(page)) ++page;
    counters_.resumed_pages = page;
    if (page == 0) return begin_page(0, now_us);
    offset_ = page * Flash::kFlashPageBytes;
    if (offset_ >= image_bytes()) {
      complete(now_us);
    } else {
      begin_page(page, now_us);
    }
    return false;
  }

  bool begin_page(std::uint32_t page, std::uint64_t now_us) {
    erased_ = true;
    old_.reset();
    return area_.erase(page) || flash_failed(now_us);
  }

  void store(std::span<const std::uint8_t> data, std::uint64_t now_us) {
    const std::uint32_t left = image_bytes() - offset_;
    if (data.size() < kBlock && data.size() < left) return give_up("the file ends before its image does", now_us);
    const std::span<const std::uint8_t> used = data.first(std::min<std::size_t>(data.size(), left));
    if (offset_ > 0 && offset_ % Flash::kFlashPageBytes == 0 && !begin_page_once(now_us)) return;
    if (!area_.program(offset_, used)) return static_cast<void>(flash_failed(now_us));
    offset_ += static_cast<std::uint32_t>(used.size());
    const bool page_full = offset_ % Flash::kFlashPageBytes == 0 || offset_ >= image_bytes();
    if (page_full && !record_.set_page_done((offset_ - 1) / Flash::kFlashPageBytes)) return static_cast<void>(flash_failed(now_us));
    if (offset_ >= image_bytes()) complete(now_us);
  }
  // A page that resume() has erased is not erased again.
  bool begin_page_once(std::uint64_t now_us) {
    const std::uint32_t page = offset_ / Flash::kFlashPageBytes;
    return page == counters_.resumed_pages || begin_page(page, now_us);
  }

  void complete(std::uint64_t now_us) {
    fault_ = area_.first_word_erased() ? area_.fault_before_release(first_word_, *header_, config_.key) : ImageFault::damaged;
    if (fault_ == ImageFault::none && area_.release(first_word_) && area_.installed(config_.board, config_.key))
      return finish(UpdateEnd::installed, "image installed", now_us);
    // What is in place is of no use.
    if (fault_ == ImageFault::none) fault_ = ImageFault::damaged;
    ++counters_.flash_errors;
    if (fault_ != ImageFault::damaged || ++damaged_ >= kDamagedTries) return refuse(image_fault_text(fault_), now_us);
    voice_.say(protocols::LogMessage::Level::error, image_fault_text(fault_), now_us);
    begin_anew(now_us);
  }

  void begin_anew(std::uint64_t now_us) {
    header_.reset();
    offset_ = 0;
    counters_.resumed_pages = 0;
    renew_record();
    waiting_ = true;  // a pause of one time-out: a server whose file is damaged is not asked without end
    asked_type_ = 0;
    asked_us_ = now_us;
  }
  // The record is erased: nothing of the least security version is lost when the power goes in between.
  bool clear_record() { return keep_security_version() && record_.clear(least_security_); }
  bool renew_record() { return keep_security_version() && record_.begin(*job_, least_security_); }
  bool keep_security_version() { return least_security_ == 0 || may_start() || area_.leave_security_version(least_security_); }

  bool flash_failed(std::uint64_t now_us) {
    ++counters_.flash_errors;
    voice_.say(protocols::LogMessage::Level::error, "flash memory refuses to be written", now_us);
    begin_anew(now_us);
    return false;
  }

  void give_up(const char* why, std::uint64_t now_us) {
    if (old_ && !erased_) return finish(UpdateEnd::failed, why, now_us);
    // There is nothing to start: ask again, and tell it every 30 s.
    voice_.say(protocols::LogMessage::Level::error, why, now_us);
    good_us_ = now_us;
    slowest_us_ = 0;
    waiting_ = false;
    info_known_ = false;
  }

  void refuse(const TextLine& why, std::uint64_t now_us) { finish(UpdateEnd::refused, why, now_us); }
  void finish(UpdateEnd end, const TextLine& why, std::uint64_t now_us) {
    end_ = end;
    if (end == UpdateEnd::installed) least_security_ = std::max(least_security_, header_->security_version);
    clear_record();
    voice_.say(end == UpdateEnd::installed ? protocols::LogMessage::Level::info : protocols::LogMessage::Level::error, why, now_us);
    end_us_ = now_us;
    next_status_us_ = now_us;
    // Without an application to start the node stays and waits for a better image.
    if (may_start()) return;
    job_.reset();
    end_ = UpdateEnd::none;
    forget_transfer();
  }
  void forget_transfer() {
    header_.reset();
    offset_ = damaged_ = 0;
    repeated_ = 0;
    counters_.resumed_pages = 0;
    info_known_ = waiting_ = false;
  }

  void on_request(const protocols::Transfer& t, std::uint64_t now_us) {
    if (t.id.data_type_id == protocols::GetNodeInfo::kType.id) {
      protocols::GetNodeInfoResponse r;
      r.status = status(now_us);
      r.unique_id = config_.unique_id;
      r.set_name(config_.name);
      r.add_to_name(key_name_suffix(config_.key.kind));
      voice_.respond(t, r, now_us);
      return;
    }
    protocols::BeginFirmwareUpdate q;
    if (!decode(t.payload, q)) return;
    protocols::BeginFirmwareUpdateResponse r;
    if (refuse_long_path(t, r)) return voice_.respond(t, r, now_us);
    const UpdateJob job{.server = q.source_node_id == 0 ? t.id.source : q.source_node_id, .own_id = voice_.own_id(), .path = q.path.path};
    const bool same = job_ && job_->server == job.server && job_->path == job.path;
    if (end_ != UpdateEnd::none || same || (job_ && now_us - good_us_ < kTakeOver_us)) {
      r.error = decltype(r.error)::in_progress;
    } else {
      forget_transfer();
      fault_ = ImageFault::none;
      job_ = job;
      good_us_ = now_us;
      record_due_ = true;
    }
    voice_.respond(t, r, now_us);
  }

  protocols::NodeStatus status(std::uint64_t now_us) const {
    using protocols::Health;
    const bool failed = fault_ != ImageFault::none || end_ == UpdateEnd::failed, idle = !job_;
    return {.uptime_s = divide(now_us - start_us_, 1'000'000u).quotient,
            .health = failed ? Health::error
                      : idle ? waiting_health_
                             : Health::ok,
            .mode = protocols::NodeMode::software_update,
            .vendor_status = idle ? waiting_status_ : static_cast<std::uint16_t>(offset_ / kBlock)};
  }
  void on_allocation(const protocols::Transfer& t, std::uint64_t now_us) {
    protocols::Allocation a;
    if (voice_.own_id() != 0 || !decode(t.payload, a)) return;
    const auto id = allocation_.on_message(a, now_us);
    if (!id) return;
    voice_.set_own_id(*id);
    receiver_.set_own_node(*id);
  }
  void send_status(std::uint64_t now_us) {
    if (now_us < next_status_us_) return;
    next_status_us_ = now_us + 500'000;
    voice_.status(status(now_us), now_us);
  }
  std::uint32_t image_bytes() const { return kImageHeaderBytes + header_->size; }

  UpdaterConfig config_;
  UpdateRecord<Flash> record_;
  ApplicationArea<Flash> area_;
  std::optional<ImageHeader> old_;  // that could be started
  std::optional<UpdateJob> job_;
  std::uint32_t least_security_;  // below it nothing is accepted
  UpdateVoice voice_;
  protocols::Receiver<4, 260> receiver_;
  AllocationClient allocation_;
  UpdateCounters counters_;
  std::optional<ImageHeader> header_;  // of the image that comes; accepted
  std::array<std::uint8_t, 8> first_word_{};
  protocols::TransferIdCounter info_id_, read_id_;
  ImageFault fault_ = ImageFault::none;
  UpdateEnd end_ = UpdateEnd::none;
  std::uint64_t start_us_ = 0, good_us_ = 0, asked_us_ = 0, slowest_us_ = 0, next_status_us_ = 0, end_us_ = 0;
  std::uint64_t file_bytes_ = 0;  // as the server says; 0: it does not
  std::uint32_t offset_ = 0, damaged_ = 0;
  unsigned repeated_ = 0;  // in a row
  std::uint16_t asked_type_ = 0, waiting_status_ = 0;
  protocols::Health waiting_health_ = protocols::Health::ok;
  std::uint8_t asked_transfer_ = 0;
  bool started_ = false, waiting_ = false, info_known_ = false, erased_ = false, record_due_ = false;
};

}  // namespace rotorloop::firmware
