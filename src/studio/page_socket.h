#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <memory>
#include <string>

#include "studio/rate_limit.h"
#include "studio/studio_core.h"

namespace gamer {

/// The WebSocket of a page. Its functions run in the thread of the server, but send() in any.
class PageSocket : public Page, public std::enable_shared_from_this<PageSocket> {
 public:
  PageSocket(boost::beast::tcp_stream stream, StudioCore& core);
  ~PageSocket() override;
  PageSocket(const PageSocket&) = delete;
  PageSocket& operator=(const PageSocket&) = delete;

  /// Answers the request that begins the WebSocket, and reads messages from then on.
  void accept(const boost::beast::http::request<boost::beast::http::empty_body>& request);
  void send(std::string message, bool is_binary) override;
  void drop_frames() override;

  /// Sockets that are open.
  static int count() { return count_; }

 private:
  struct Outgoing {
    std::string message;
    bool is_binary;
  };
  void read();
  void take(boost::beast::error_code error);
  void enqueue(Outgoing outgoing);
  void write();
  void close(const std::string& reason);
  void leave();

  static int count_;

  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  boost::beast::flat_buffer buffer_;
  boost::asio::steady_timer pause_;
  StudioCore& core_;
  RateLimit messages_, bytes_;
  std::deque<Outgoing> outgoing_;  ///< the first is being written
  std::size_t waiting_bytes_ = 0;
  bool is_open_ = false;
};

}  // namespace gamer
