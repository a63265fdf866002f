// The one server of all live pages: a page, its script and curves, and a stream of values (server-sent events), on this machine's loopback
// alone. Values go out; what would change anything comes in only with the token that the page's address carries. Safety never depends
// on it: a browser may be closed at any moment.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace rotorloop::live {

struct LiveServerConfig {
  int port = 0;        // 0: one that is free
  std::string page;    // HTML; loads /live.js (what all pages share), /page.js, /uplot.js, /uplot.css and /live.css
  std::string script;  // page.js
  std::string title;
};

class LiveServer {
 public:
  static constexpr std::size_t kMostViewers = 8;  // each holds a thread of the server

  // Called in a thread of the server. Answers what the page shows.
  using Order = std::function<std::string(std::string_view what)>;

  // Throws Error (exit 3) when the port is taken. `order`: what a page may ask for; none: pages only look.
  explicit LiveServer(const LiveServerConfig& config, Order order = {});
  ~LiveServer();  // ends all streams and threads
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  std::string address() const;  // "http://127.0.0.1:41234/#TOKEN"
  // To every page that is open, from any thread; never blocks. A page that is too slow misses values.
  void publish(const std::string& json);
  std::size_t viewers() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rotorloop::live
