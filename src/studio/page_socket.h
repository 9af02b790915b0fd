#pragma once

#include <boost/asio/any_io_executor.hpp>
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

class PageSocket;

/// The address of a page for other threads, which outlives its socket. The socket itself stays in
/// the thread of the server.
class Mailbox : public Page {
 public:
  Mailbox(const std::shared_ptr<PageSocket>& socket, boost::asio::any_io_executor server);

  void send(std::string message, bool is_binary) override;
  void drop_frames() override;

 private:
  std::weak_ptr<PageSocket> socket_;
  boost::asio::any_io_executor server_;
};

/// The WebSocket of a page. All its functions run in the thread of the server.
class PageSocket : public std::enable_shared_from_this<PageSocket> {
 public:
  struct Outgoing {
    std::string message;
    bool is_binary;
  };

  PageSocket(boost::beast::tcp_stream stream, StudioCore& core);
  ~PageSocket();
  PageSocket& operator=(PageSocket&&) = delete;

  /// Answers the request that begins the WebSocket, and reads messages from then on.
  void accept(const boost::beast::http::request<boost::beast::http::empty_body>& request);
  void enqueue(Outgoing outgoing);
  void drop_frames();

  /// Number of open sockets.
  static int count() { return count_; }

 private:
  void read();
  void take(boost::beast::error_code error);
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
  std::shared_ptr<Mailbox> mailbox_;  ///< null while the socket is not open
};

}  // namespace gamer
