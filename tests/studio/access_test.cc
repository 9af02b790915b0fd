#include "studio/access.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "studio/http_answer.h"
#include "studio/rate_limit.h"

namespace gamer::access_test {
namespace {

TEST(Token, Has128Bits) {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) {
    const std::string token = make_token();
    EXPECT_EQ(token.size(), 32u);
    EXPECT_EQ(token.find_first_not_of("0123456789abcdef"), std::string::npos) << token;
    tokens.insert(token);
  }
  EXPECT_EQ(tokens.size(), 100u);
}

TEST(Secrets, AreEqualOrNot) {
  EXPECT_TRUE(are_equal_secrets("", ""));
  EXPECT_TRUE(are_equal_secrets("0123", "0123"));
  for (const char* other : {"", "012", "01234", "1123", "0124", "0133"}) {
    EXPECT_FALSE(are_equal_secrets("0123", other)) << other;
  }
}

TEST(Host, IsThisMachine) {
  for (const char* host : {"127.0.0.1", "localhost", "127.0.0.1:80", "localhost:65535"}) {
    EXPECT_TRUE(is_own_host(host)) << host;
  }
  for (const char* host :
       {"", "127.0.0.2", "127.0.0.1.evil.org", "localhost.evil.org:80", "evil.org",
        "127.0.0.1:", "127.0.0.1:80:80", "127.0.0.1:8x", "127.0.0.1:123456", "evil.org:localhost",
        "LOCALHOST ", "[::1]:80", "localhost@evil.org", "127.0.0.1:80@evil.org"}) {
    EXPECT_FALSE(is_own_host(host)) << host;
  }
}

TEST(Origin, IsThatOfTheHost) {
  EXPECT_TRUE(is_own_origin("http://127.0.0.1:80", "127.0.0.1:80"));
  for (const char* origin : {"", "null", "http://127.0.0.1:81", "https://127.0.0.1:80",
                             "http://127.0.0.1:80.evil.org", "http://evil.org", "127.0.0.1:80"}) {
    EXPECT_FALSE(is_own_origin(origin, "127.0.0.1:80")) << origin;
  }
}

TEST(Cookie, IsFoundByItsName) {
  EXPECT_EQ(cookie_value("a=1; gstudio-1=x=y; b=2", "gstudio-1"), "x=y");
  EXPECT_EQ(cookie_value("gstudio-1=z", "gstudio-1"), "z");
  EXPECT_EQ(cookie_value("gstudio-1=", "gstudio-1"), "");
  for (const char* header : {"", ";", "gstudio-12=z", "xgstudio-1=z", "=gstudio-1"}) {
    EXPECT_FALSE(cookie_value(header, "gstudio-1")) << header;
  }
}

TEST(Target, HasPathAndToken) {
  EXPECT_EQ(parse_target("/x?y=1&token=ab&z").path, "/x");
  EXPECT_EQ(parse_target("/x?y=1&token=ab&z").token, "ab");
  EXPECT_EQ(parse_target("/?token=").token, "");
  for (const char* target : {"", "/", "/?", "/token=ab", "/?atoken=ab", "/?token%3dab"}) {
    EXPECT_FALSE(parse_target(target).token) << target;
  }
}

class Answer : public testing::Test {
 protected:
  HttpAnswer ask(std::string_view target) {
    request.target = target;
    return answer_request(request, {"right", "cookie", "gstudio-1"}, "no such folder");
  }
  unsigned status(std::string_view target) { return ask(target).status; }

  HttpRequest request = {"GET", "", "127.0.0.1:1", {}, "gstudio-1=cookie", false};
};

TEST_F(Answer, CookieOpensThePage) {
  EXPECT_EQ(status("/"), 200u);
  EXPECT_NE(ask("/").body.find("<html"), std::string::npos);
  EXPECT_EQ(ask("/").type, "text/html; charset=utf-8");
  request.cookie = "gstudio-1=wrong";
  EXPECT_EQ(status("/"), 403u);
  request.cookie.reset();
  EXPECT_EQ(status("/"), 403u);
  EXPECT_EQ(status("/index.html"), 403u);
  EXPECT_EQ(status("/output/x.fits"), 403u);
}

TEST_F(Answer, TokenGivesTheCookie) {
  request.cookie.reset();
  const HttpAnswer welcome = ask("/?token=right");
  EXPECT_EQ(welcome.status, 200u);
  ASSERT_EQ(welcome.fields.size(), 1u);
  EXPECT_EQ(welcome.fields[0].second, "gstudio-1=cookie; HttpOnly; SameSite=Strict; Path=/");
  for (const char* target : {"/?token=wrong", "/?token=", "/?token=righ", "/?token=right2"}) {
    EXPECT_EQ(status(target), 403u) << target;
  }
}

TEST_F(Answer, OthersAreRefused) {
  request.host = "evil.org";
  EXPECT_EQ(status("/?token=right"), 403u);
  EXPECT_EQ(status("/"), 403u);
  request.host.reset();
  EXPECT_EQ(status("/"), 400u);
  request.host = "localhost:1";
  request.origin = "http://evil.org";
  EXPECT_EQ(status("/"), 403u);
  EXPECT_EQ(status("/?token=right"), 403u);
  request.origin = "http://localhost:1";
  EXPECT_EQ(status("/"), 200u);
  request.method = "POST";
  EXPECT_EQ(status("/"), 405u);
}

TEST_F(Answer, WebSocketNeedsAnOrigin) {
  request.is_upgrade = true;
  EXPECT_EQ(status("/ws"), 403u);
  request.origin = "http://evil.org";
  EXPECT_EQ(status("/ws"), 403u);
  request.origin = "http://127.0.0.1:1";
  EXPECT_TRUE(ask("/ws").is_upgrade);
  EXPECT_FALSE(ask("/").is_upgrade);
  request.is_upgrade = false;
  EXPECT_EQ(status("/ws"), 400u);
  request.is_upgrade = true;
  request.cookie.reset();
  EXPECT_FALSE(ask("/ws").is_upgrade);
}

TEST_F(Answer, FilesAreNamesAlone) {
  for (const char* target : {"", "//", "/../index.html", "/index.html/", "/.", "/%69ndex.html",
                             "/output/../index.html", "/output/", "/output//etc/passwd",
                             "/output/%2e%2e/x", "/output/x.fits", "http://127.0.0.1:1/"}) {
    EXPECT_EQ(status(target), 404u) << target;
  }
}

TEST(RateLimit, WaitsForWhatIsTooMuch) {
  RateLimit limit(10, 5);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(limit.take(1, 0), 0);
  EXPECT_NEAR(limit.take(1, 0), 0.1, 1e-12);
  EXPECT_NEAR(limit.take(1, 0.1), 0.1, 1e-12);
  EXPECT_EQ(limit.take(5, 10), 0);
}

}  // namespace
}  // namespace gamer::access_test
