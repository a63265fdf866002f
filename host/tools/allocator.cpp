#include "host/tools/allocator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <sstream>

#include "host/base/error.hpp"

namespace rotorloop::tools {
namespace {

using protocols::Allocation;

constexpr std::uint8_t kAllocationPriority = 24, kTimePriority = 1;
constexpr std::int64_t kForget_ns = static_cast<std::int64_t>(Allocation::kAllocatorForgets_us) * 1000;
constexpr std::int64_t kTimePeriod_ns = 1'000'000'000, kMasterLost_ns = 2'200'000'000;
constexpr std::uint8_t kLastForNodes = 125;  // 126 and 127 are for tools
// A node tells its status once a second. Whoever asks for an id and gets no answer repeats that within a second.
constexpr std::int64_t kListen_ns = 1'500'000'000;

}  // namespace

std::string unique_id_text(const UniqueId& id) { return fmt::format("{:02x}", fmt::join(id, "")); }

std::map<UniqueId, std::uint8_t> parse_allocation_table(const std::string& text, const std::string& name) {
  std::map<UniqueId, std::uint8_t> table;
  std::istringstream lines(text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    const auto fail = [&](const std::string& what) {
      throw Error(
          {fmt::format("{}:{}", name, number), what, "", "a line is: 32 hexadecimal digits of the unique id = node id of 1 to 125"});
    };
    UniqueId id{};
    int node = 0;
    if (line.size() < 36 || line.substr(32, 3) != " = ") fail("is no line UNIQUE_ID = NODE_ID");
    for (std::size_t i = 0; i < 16; ++i) {
      if (std::from_chars(line.data() + 2 * i, line.data() + 2 * i + 2, id[i], 16).ptr != line.data() + 2 * i + 2)
        fail("the unique id is not hexadecimal");
    }
    const char* const end = line.data() + line.size();
    if (std::from_chars(line.data() + 35, end, node).ptr != end || node < 1 || node > kLastForNodes)
      fail("the node id is out of range: 1 to 125");
    if (!table.emplace(id, static_cast<std::uint8_t>(node)).second) fail("this unique id stands there twice");
    if (std::count_if(table.begin(), table.end(), [&](const auto& row) { return row.second == node; }) > 1)
      fail(fmt::format("node id {} stands there twice", node));
  }
  return table;
}

std::string allocation_table_text(const std::map<UniqueId, std::uint8_t>& table) {
  std::string text = "# Node ids that `rotorloop esc serve` gave: unique id = node id.\n";
  for (const auto& [id, node] : table) text += fmt::format("{} = {}\n", unique_id_text(id), node);
  return text;
}

Allocator::Allocator(ToolNode& tool, std::map<UniqueId, std::uint8_t> table, std::function<void(const Allocated&)> told)
    : tool_(tool), table_(std::move(table)), report_(std::move(told)), begun_ns_(tool.now_ns()) {
  tool.on_anonymous<Allocation>([this](const Allocation& request) { on_request(request); });
}

// The requesting node hears what is known of its id so far and goes on from there: 6, 12, 16 bytes.
void Allocator::on_request(const Allocation& request) {
  if (tool_.now_ns() - heard_ns_ > kForget_ns) heard_.clear();
  if (request.first_part) heard_.clear();
  const std::size_t wanted = std::min<std::size_t>(Allocation::kMaxIdBytesInRequest, 16 - heard_.size());
  // A part of another length than the next one has is of a node that heard something else.
  if ((!request.first_part && heard_.empty()) || request.unique_id.count != wanted) return;
  heard_.insert(heard_.end(), request.unique_id.items.begin(), request.unique_id.items.begin() + request.unique_id.count);
  heard_ns_ = tool_.now_ns();
  Allocation answer;
  answer.unique_id.assign(heard_);
  if (heard_.size() == 16) {
    UniqueId id{};
    std::copy(heard_.begin(), heard_.end(), id.begin());
    heard_.clear();
    if (tool_.now_ns() - begun_ns_ >= kListen_ns) give(id, request.node_id);
    return;
  }
  tool_.broadcast(answer, kAllocationPriority);
}

void Allocator::give(const UniqueId& id, std::uint8_t preferred) {
  Allocated given{.unique_id = id};
  if (const auto known = table_.find(id); known != table_.end()) {
    const Holder holder = holder_of(known->second, id);
    if (holder == Holder::not_known_yet) return;
    if (holder == Holder::another) {
      given.stored_id = known->second;
      if (const auto& info = tool_.nodes().at(known->second).info) given.held_by = info->unique_id;
    } else {
      given.node_id = known->second;
    }
  }
  waiting_since_ns_.erase(id);
  if (given.node_id == 0) {
    given.node_id = free_id(preferred);
    given.is_new = true;
    if (given.node_id == 0) return void(++refused_);
    table_[id] = given.node_id;
  }
  Allocation answer;
  answer.unique_id.assign(id);
  answer.node_id = given.node_id;
  tool_.broadcast(answer, kAllocationPriority);
  report_(given);
}

// A node that started anew was heard with this id a moment ago, and has none now; another that holds it goes on telling its status.
Allocator::Holder Allocator::holder_of(std::uint8_t node, const UniqueId& id) {
  const auto seen = tool_.nodes().find(node);
  if (seen == tool_.nodes().end() || tool_.now_ns() - seen->second.heard_ns > kToolOffline_ns) return Holder::nobody;
  if (seen->second.info) return seen->second.info->unique_id == id ? Holder::itself : Holder::another;
  const std::int64_t since_ns = waiting_since_ns_.try_emplace(id, tool_.now_ns()).first->second;
  if (seen->second.heard_ns > since_ns) return Holder::another;
  return tool_.now_ns() - since_ns > kListen_ns ? Holder::nobody : Holder::not_known_yet;
}

std::uint8_t Allocator::free_id(std::uint8_t preferred) const {
  std::set<std::uint8_t> taken{tool_.node_id()};
  for (const auto& [other, node] : table_) taken.insert(node);
  for (const auto& [node, seen] : tool_.nodes()) taken.insert(node);
  if (preferred >= 1 && preferred <= kLastForNodes) {
    for (std::uint8_t node = preferred; node <= kLastForNodes; ++node) {
      if (!taken.contains(node)) return node;
    }
  }
  for (std::uint8_t node = kLastForNodes; node >= 1; --node) {
    if (!taken.contains(node)) return node;
  }
  return 0;
}

TimeMaster::TimeMaster(ToolNode& tool) : tool_(tool), next_ns_(tool.now_ns()), other_ns_(tool.now_ns() - 2 * kMasterLost_ns) {
  tool.on<protocols::GlobalTimeSync>([this](const protocols::GlobalTimeSync&, std::uint8_t source) {
    if (source < tool_.node_id()) other_ns_ = tool_.now_ns();
  });
}

bool TimeMaster::leads() const { return tool_.now_ns() - other_ns_ > kMasterLost_ns; }

// Each message tells when the one before it was sent: that is when the receivers heard it.
void TimeMaster::step() {
  if (tool_.now_ns() < next_ns_) return;
  next_ns_ = tool_.now_ns() + kTimePeriod_ns;
  if (!leads()) {
    sent_ns_ = 0;
    return;
  }
  protocols::GlobalTimeSync m;
  m.previous_us = static_cast<std::uint64_t>(sent_ns_ / 1000);
  sent_ns_ = tool_.now_ns();
  tool_.broadcast(m, kTimePriority);
}

}  // namespace rotorloop::tools
