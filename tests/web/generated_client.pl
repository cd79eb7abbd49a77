# A client that OpenAPI::Client makes of the document while it runs: URL OF THE DAEMON, GLB.
use strict;
use warnings;
use Mojo::JSON qw(encode_json);
use OpenAPI::Client;

my ($url, $path) = @ARGV;
my $client = OpenAPI::Client->new("$url/openapi.json", base_url => $url);
open my $file, '<:raw', $path or die $!;
my $glb = do { local $/; <$file> };

sub answer {
    my ($tx, @statuses) = @_;
    my $status = $tx->res->code // 0;
    die $tx->req->url . ": $status " . $tx->res->body unless grep { $_ == $status } @statuses;
    return $tx->res;
}

my @names = map { $_->{name} } @{answer($client->listTechniques, 200)->json->{techniques}};
# The bytes go as they are; their type is one of those that the document has.
my $upload = $client->ua->build_tx(POST => "$url/v1/scenes", {'Content-Type' => 'model/gltf-binary'}, $glb);
my $scene = answer($client->ua->start($upload), 200, 201)->json;
my $known = answer($client->getScene({id => $scene->{id}}), 200)->json;
my $named = answer($client->changeScene({id => $scene->{id}}, json => {name => 'From Perl'}), 200)->json;
my $picture = answer($client->renderScene({id => $scene->{id}},
    json => {width => 160, height => 120, technique => {name => 'hard'}}), 200);
my $refused = $client->renderScene({id => $scene->{id}}, json => {width => 0});
print encode_json({techniques => \@names, id => $known->{id}, name => $named->{name},
    magic => unpack('H*', substr $picture->body, 0, 8), type => $picture->headers->content_type,
    refused => $refused->res->code, size => [unpack 'N2', substr $picture->body, 16, 8]});
