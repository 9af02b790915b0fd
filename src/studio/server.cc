#include "studio/server.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <optional>
#include <utility>

#include "core/message.h"
#include "studio/access.h"
#include "studio/http_answer.h"
#include "studio/page_socket.h"

namespace gamer {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr int most_connections = 64, most_sockets = 16;
constexpr std::uint32_t most_header_bytes = 8192;
constexpr auto patience = std::chrono::seconds(30);

/// The data that all connections share.
struct Shared {
  StudioCore* core;  ///< not null while the server runs
  ServerSecrets secrets;
  int connections = 0;
};

/// A connection of a browser; each request is read and answered in turn.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Shared& shared) : stream_(std::move(socket)), shared_(shared) {
    ++shared_.connections;
  }
  ~Connection() { --shared_.connections; }
  Connection& operator=(Connection&&) = delete;

  void read() {
    parser_.emplace();
    parser_->header_limit(most_header_bytes);
    parser_->body_limit(0);
    stream_.expires_after(patience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       if (!error) return self->answer();
                       self->close();
                     });
  }

 private:
  using Request = http::request<http::empty_body>;

  /// The value of a field that occurs once; nothing otherwise.
  static std::optional<std::string_view> field(const Request& request, http::field name) {
    if (request.count(name) != 1) return std::nullopt;
    const auto value = request[name];
    return std::string_view(value.data(), value.size());
  }

  static std::string_view view(boost::string_view text) { return {text.data(), text.size()}; }

  void answer() {
    const Request& request = parser_->get();
    const HttpRequest seen{
        view(request.method_string()),       view(request.target()),
        field(request, http::field::host),   field(request, http::field::origin),
        field(request, http::field::cookie), beast::websocket::is_upgrade(request)};
    HttpAnswer answer = answer_request(seen, shared_.secrets, shared_.core->options().folder);
    const bool has_foreign_origin = request.count(http::field::origin) > 1;
    if (has_foreign_origin) answer = {.status = 400, .body = "a request has one Origin\n"};
    if (answer.is_upgrade && PageSocket::count() < most_sockets) {
      return std::make_shared<PageSocket>(std::move(stream_), *shared_.core)->accept(request);
    }
    if (answer.is_upgrade) answer = {.status = 503, .body = "too many pages are open\n"};
    respond(answer);
  }

  template <typename Body>
  void send(std::shared_ptr<http::response<Body>> response, const HttpAnswer& answer) {
    response->version(parser_->get().version());
    response->keep_alive(parser_->get().keep_alive());
    response->set(http::field::content_type, answer.type);
    for (const auto& [name, value] : safety_fields()) response->set(name, value);
    for (const auto& [name, value] : answer.fields) response->set(name, value);
    response->prepare_payload();
    stream_.expires_after(patience);
    http::async_write(stream_, *response,
                      [self = shared_from_this(), response](beast::error_code error, std::size_t) {
                        if (error || response->need_eof()) return self->close();
                        self->read();
                      });
  }

  void respond(const HttpAnswer& answer) {
    const auto status = static_cast<http::status>(answer.status);
    const bool has_body = parser_->get().method() != http::verb::head;
    if (!answer.file.empty() && has_body) {
      const auto response = std::make_shared<http::response<http::file_body>>();
      response->result(status);
      beast::error_code error;
      response->body().open(answer.file.c_str(), beast::file_mode::scan, error);
      if (!error) return send(response, answer);
    }
    const auto response = std::make_shared<http::response<http::string_body>>();
    response->result(status);
    if (has_body) response->body() = answer.body;
    send(response, answer);
  }

  void close() {
    beast::error_code error;
    stream_.socket().shutdown(tcp::socket::shutdown_send, error);
  }

  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  Shared& shared_;
};

}  // namespace

class Server::Impl {
 public:
  explicit Impl(const StudioOptions& options) : shared_{nullptr, make_secrets(options.token_file)} {
    const int port = options.port;
    try {
      const tcp::endpoint place(asio::ip::address_v4::loopback(),
                                static_cast<unsigned short>(port));
      acceptor_.open(place.protocol());
      acceptor_.set_option(asio::socket_base::reuse_address(true));
      acceptor_.bind(place);
      acceptor_.listen();
    } catch (const boost::system::system_error& error) {
      throw run_error("gstudio: port {} of 127.0.0.1: {}", port, error.code().message());
    }
    port_ = acceptor_.local_endpoint().port();
    shared_.secrets.cookie_name = fmt::format("gstudio-{}", port_);
  }

  std::string address() const {
    return fmt::format("http://127.0.0.1:{}/?token={}", port_, shared_.secrets.token);
  }

  void run(StudioCore& core) {
    shared_.core = &core;
    accept();
    context_.run();
  }

 private:
  void accept() {
    acceptor_.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (!error && shared_.connections < most_connections) {
        std::make_shared<Connection>(std::move(socket), shared_)->read();
      }
      if (!error) return accept();
      // The process may have too many open files for a moment.
      pause_.expires_after(std::chrono::milliseconds(100));
      pause_.async_wait([this](beast::error_code) { accept(); });
    });
  }

  Shared shared_;  // outlives the connections, which end with the context
  asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  asio::steady_timer pause_{context_};
  int port_ = 0;
};

Server::Server(const StudioOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Server::~Server() = default;
std::string Server::address() const { return impl_->address(); }
void Server::run(StudioCore& core) { impl_->run(core); }

}  // namespace gamer
