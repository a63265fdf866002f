// Requests are answered only when they name this server as their host: a page of the network whose name was pointed at this machine cannot
// read the stream, and no other page has the token.
#include "bench/hil/live/live_server.hpp"

#include <httplib.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <thread>

#include "bench/hil/live/live_assets.hpp"
#include "host/base/error.hpp"

namespace rotorloop::live {
namespace {

// 128 bits from the system, in hexadecimal.
std::string new_token() {
  std::ifstream source("/dev/urandom", std::ios::binary);
  std::string token;
  for (int i = 0; i < 16; ++i) {
    constexpr std::string_view kTokenDigits = "0123456789abcdef";
    const auto byte = static_cast<unsigned>(source.get()) & 0xFFu;
    token += kTokenDigits[byte >> 4];
    token += kTokenDigits[byte & 15u];
  }
  if (!source) throw Error({"live page", "no random numbers from the system", "", ""}, ExitCode::device);
  return token;
}

// Takes the same time whatever is wrong.
bool same_token(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

}  // namespace

struct LiveServer::Impl {
  httplib::Server server;
  std::thread thread;
  int port = 0;
  std::string token = new_token(), page, script;
  Order order;
  std::mutex mutex;
  std::condition_variable changed;
  std::string newest;  // as one event
  std::uint64_t number = 0;
  std::atomic<bool> stop{false};
  std::atomic<std::size_t> viewers{0};

  bool for_us(const httplib::Request& request) const {
    const std::string host = request.get_header_value("Host"), port_text = std::to_string(port);
    return host == "127.0.0.1:" + port_text || host == "localhost:" + port_text;
  }
  void asset(const char* path, std::string_view content, const char* type) {
    server.Get(path, [content, type](const httplib::Request&, httplib::Response& r) { r.set_content(std::string(content), type); });
  }
  void stream(httplib::Response& response) {
    if (viewers.fetch_add(1) >= kMostViewers) {
      --viewers;
      response.status = 503;
      response.set_content("too many pages are open", "text/plain");
      return;
    }
    response.set_header("Cache-Control", "no-store");
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, last = std::uint64_t{0}](std::size_t, httplib::DataSink& sink) mutable {
          std::unique_lock lock(mutex);
          const bool came = changed.wait_for(lock, std::chrono::seconds(1), [&] { return stop || number != last; });
          if (stop) return false;
          const std::string text = came ? newest : ": still here\n\n";
          last = number;
          lock.unlock();
          return sink.write(text.data(), text.size());
        },
        [this](bool) { --viewers; });
  }
};

LiveServer::LiveServer(const LiveServerConfig& config, Order order) : impl_(std::make_unique<Impl>()) {
  Impl& s = *impl_;
  s.page = config.page;
  s.script = config.script;
  s.order = std::move(order);
  // A browser holds up to six connections to a server, some of them before it has anything to ask, and each holds a thread for as long.
  // With fewer threads two pages wait for each other's connections, and on a busy machine a script comes too late for its page.
  constexpr std::size_t kConnectionsOfABrowser = 6;
  s.server.new_task_queue = [] { return new httplib::ThreadPool(kMostViewers * kConnectionsOfABrowser); };
  s.server.set_keep_alive_max_count(1000);  // requests of a connection: closing it after five costs a page its next one
  s.server.set_payload_max_length(4096);
  s.server.set_default_headers({{"Content-Security-Policy", "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:"},
                                {"X-Content-Type-Options", "nosniff"}});
  s.server.set_pre_routing_handler([&s](const httplib::Request& request, httplib::Response& response) {
    if (s.for_us(request)) return httplib::Server::HandlerResponse::Unhandled;
    response.status = 403;
    response.set_content("this server answers to 127.0.0.1 alone", "text/plain");
    return httplib::Server::HandlerResponse::Handled;
  });
  s.asset("/uplot.js", kUplotScript, "text/javascript");
  s.asset("/uplot.css", kUplotStyle, "text/css");
  s.asset("/live.js", kLiveScript, "text/javascript");
  s.asset("/live.css", kLiveStyle, "text/css");
  s.server.Get("/", [&s](const httplib::Request&, httplib::Response& r) { r.set_content(s.page, "text/html; charset=utf-8"); });
  s.server.Get("/page.js", [&s](const httplib::Request&, httplib::Response& r) { r.set_content(s.script, "text/javascript"); });
  s.server.Get("/events", [&s](const httplib::Request&, httplib::Response& r) { s.stream(r); });
  s.server.Post("/order", [&s](const httplib::Request& request, httplib::Response& r) {
    if (!same_token(request.get_header_value("X-Token"), s.token)) {
      r.status = 403;
      r.set_content("open the page by the address that the command printed: it carries the token", "text/plain");
    } else if (!s.order) {
      r.status = 404;
      r.set_content("this page only looks", "text/plain");
    } else {
      r.set_content(s.order(request.body), "text/plain; charset=utf-8");
    }
  });
  s.port = config.port == 0 ? s.server.bind_to_any_port("127.0.0.1") : (s.server.bind_to_port("127.0.0.1", config.port) ? config.port : -1);
  if (s.port <= 0)
    throw Error({.where = "live page",
                 .what = "cannot listen on 127.0.0.1, port " + std::to_string(config.port),
                 .likely = "another program has the port",
                 .remedy = "give another port, or 0 for one that is free"},
                ExitCode::device);
  s.thread = std::thread([&s] { s.server.listen_after_bind(); });
}

LiveServer::~LiveServer() {
  impl_->stop = true;
  impl_->changed.notify_all();
  impl_->server.stop();
  impl_->thread.join();
}

std::string LiveServer::address() const { return "http://127.0.0.1:" + std::to_string(impl_->port) + "/#" + impl_->token; }

void LiveServer::publish(const std::string& json) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->newest = "data: " + json + "\n\n";
    ++impl_->number;
  }
  impl_->changed.notify_all();
}

std::size_t LiveServer::viewers() const { return impl_->viewers; }

}  // namespace rotorloop::live
