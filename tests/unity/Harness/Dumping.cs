// Describes objects of the scene as JSON.
using System;
using System.Collections.Generic;
using System.Linq;
using Newtonsoft.Json.Linq;
using StereoCell;
using UnityEngine;

static class Dumping
{
    public static JObject Dump(GameObject made)
    {
        var at = made.transform;
        var dump = new JObject(
            new JProperty("name", made.name),
            new JProperty("active", made.activeSelf),
            new JProperty("position", Dump(at.position)),
            new JProperty("scale", Dump(at.localScale)));
        var tile = made.GetComponent<Tile>();
        if (!ReferenceEquals(tile, null)) dump["tile"] = tile.ShowsVolume;
        var collider = made.GetComponent<BoxCollider>();
        if (!ReferenceEquals(collider, null)) dump["collider"] = Dump(collider.size);
        var group = made.GetComponent<LODGroup>();
        if (!ReferenceEquals(group, null))
        {
            dump["lods"] = new JArray(group.Lods.Select(lod => new JArray(lod.screenRelativeTransitionHeight, lod.renderers.Length)));
            dump["size"] = group.size;
        }
        AddMesh(dump, made);
        var box = made.GetComponent<VolumeBox>();
        if (!ReferenceEquals(box, null))
        {
            dump["channels"] = new JArray(box.channels);
            dump["file"] = box.file;
            dump["level"] = box.level;
        }
        if (at.childCount > 0) dump["children"] = new JArray(Enumerable.Range(0, at.childCount).Select(i => Dump(at.GetChild(i).gameObject)));
        return dump;
    }

    static void AddMesh(JObject dump, GameObject made)
    {
        var mesh = made.GetComponent<MeshFilter>();
        if (!ReferenceEquals(mesh, null))
        {
            dump["vertices"] = new JArray(mesh.sharedMesh.vertices.Select(v => Dump(v)));
            dump["world"] = new JArray(mesh.sharedMesh.vertices.Select(v => Dump(made.transform.TransformPoint(v))));
            if (mesh.sharedMesh.triangles != null) dump["triangles"] = new JArray(mesh.sharedMesh.triangles);
        }
        var renderer = made.GetComponent<Renderer>();
        if (ReferenceEquals(renderer, null)) return;
        dump["enabled"] = renderer.enabled;
        dump["order"] = renderer.sortingOrder;
        if (renderer.Block != null) dump["block"] = Dump(renderer.Block);
        if (!ReferenceEquals(renderer.sharedMaterial, null))
        {
            dump["material"] = Dump(renderer.sharedMaterial.Values);
            dump["materialName"] = renderer.sharedMaterial.name;
        }
    }

    static JToken Dump(IDictionary<string, object> values)
    {
        return new JObject(values.Select(pair => new JProperty(pair.Key, Dump(pair.Value))));
    }

    public static JToken Dump(object value)
    {
        if (value is Vector3) return new JArray(((Vector3)value).x, ((Vector3)value).y, ((Vector3)value).z);
        if (value is Vector4) return new JArray(((Vector4)value).x, ((Vector4)value).y, ((Vector4)value).z, ((Vector4)value).w);
        if (value is Color) return new JArray(((Color)value).r, ((Color)value).g, ((Color)value).b, ((Color)value).a);
        var texture = value as Texture;
        if (ReferenceEquals(texture, null)) return new JValue(value);
        var depth = texture is Texture3D ? ((Texture3D)texture).depth : texture is RenderTexture ? ((RenderTexture)texture).volumeDepth : 1;
        return new JObject(
            new JProperty("size", new JArray(texture.width, texture.height, depth)),
            new JProperty("format", texture.Format),
            new JProperty("wrap", texture.wrapMode.ToString()),
            new JProperty("linear", !(texture is Texture2D) || ((Texture2D)texture).IsLinear),
            new JProperty("texels", Convert.ToBase64String(texture.Data)));
    }
}
