#include "server/transport/authentication.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace lambent {
namespace {

using testing::HasSubstr;

class TokenFile : public testing::Test {
 protected:
  TokenFile() {
    std::string name = (std::filesystem::temp_directory_path() / ("lambent_token_" + std::string(6, 'X'))).string();
    EXPECT_TRUE(::mkdtemp(name.data()));
    folder_ = name;
    path_ = folder_ / "inner" / "token";
  }
  ~TokenFile() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_, path_;
};

TEST_F(TokenFile, is_made_once_and_only_its_owner_can_read_it) {
  const auto made = read_token(path_, true), again = read_token(path_, true);
  ASSERT_TRUE(made && again) << made.error();
  EXPECT_TRUE(is_nonce(*made));
  EXPECT_EQ(*made, *again);
  struct stat status {};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  ASSERT_EQ(::stat(path_.parent_path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path_.parent_path()), {}), 1);
}

TEST_F(TokenFile, is_not_made_unless_allowed) {
  EXPECT_THAT(read_token(path_, false).error(), HasSubstr(path_.string()));
}

TEST_F(TokenFile, open_to_others_or_without_a_token_is_refused) {
  ASSERT_TRUE(read_token(path_, true));
  ::chmod(path_.c_str(), 0640);
  EXPECT_THAT(read_token(path_, true).error(), HasSubstr("chmod 600"));
  ::chmod(path_.c_str(), 0600);
  std::ofstream(path_) << "short";
  EXPECT_THAT(read_token(path_, true).error(), HasSubstr("64 hexadecimal"));
  std::ofstream(path_) << "";
  EXPECT_FALSE(read_token(path_, true));
  EXPECT_FALSE(read_token(folder_, true));
}

TEST_F(TokenFile, in_a_folder_that_others_may_write_to_is_not_made) {
  const auto open = folder_ / "open";
  std::filesystem::create_directory(open);
  ::chmod(open.c_str(), 0777);
  EXPECT_THAT(read_token(open / "token", true).error(), HasSubstr("chmod 700"));
}

TEST(Proof, depends_on_the_token_the_role_and_both_nonces) {
  const std::string token(64, 'a'), a = make_nonce(), b = make_nonce();
  const std::string reference = proof(token, "client", a, b);
  EXPECT_EQ(reference, proof(token, "client", a, b));
  EXPECT_NE(reference, proof(token, "daemon", a, b));
  EXPECT_NE(reference, proof(token, "client", b, a));
  EXPECT_NE(reference, proof(std::string(64, 'b'), "client", a, b));
  EXPECT_TRUE(same_secret(reference, reference));
  EXPECT_FALSE(same_secret(reference, reference.substr(1)));
}

}  // namespace
}  // namespace lambent
